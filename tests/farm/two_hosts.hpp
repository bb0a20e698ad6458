// Two network namespaces of this process alone, joined by a cable that can be cut, lossy and
// narrow. They are gone with it, and nothing outside them is touched.
// Threads: a thread that visits one, and whatever it starts there, uses its network only.
#pragma once

#include <string>

namespace pvsfarm {

class TwoHosts {
 public:
  // "" or what this machine lacks for it: root, ip, nft.
  static std::string missing();

  explicit TwoHosts(std::string log);  // prefix of the logs of ip and nft. Aborts if it fails.
  ~TwoHosts();
  TwoHosts(const TwoHosts&) = delete;
  TwoHosts& operator=(const TwoHosts&) = delete;

  static const char* address(int host) { return host == 0 ? "10.91.7.1" : "10.91.7.2"; }

  // The calling thread is on that host as long as this lives.
  class Visit {
   public:
    Visit(const TwoHosts& hosts, int host);
    ~Visit();
    Visit(const Visit&) = delete;
    Visit& operator=(const Visit&) = delete;

   private:
    int home_;
  };

  // What arrives at `host` by the cable: all of it, this part of it lost, or nothing.
  void receives(int host, bool anything, double lost_percent = 0);
  void rate(double mbit_per_s);  // of both ends
  void heal();

 private:
  void run(int host, const std::string& command) const;

  std::string log_;
  int ns_[2] = {-1, -1};
};

}  // namespace pvsfarm
