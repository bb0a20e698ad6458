// The coordinator's figures and health over HTTP, for Prometheus and for whoever restarts programs:
//
//   GET /metrics   figures, as metrics.hpp
//   GET /healthz   200 while the coordinator's loop turns; 503 once it stands
//   GET /readyz    200 while workers are welcome; 503 before, and while the store is written
//
// One thread of its own reads what was published last, so it answers while the loop is busy. It
// changes nothing. The only include of libmicrohttpd.
// Threads: publish() from one thread.
#pragma once

#include <chrono>
#include <memory>
#include <string>

#include "common/base/result.hpp"
#include "common/wire/messages.hpp"

namespace pvsfarm {

class HttpServer {
 public:
  // `address`: PORT (of 127.0.0.1), HOST:PORT or [HOST]:PORT, HOST an address; port 0 lets the
  // system choose. `stands_after`: without a publish() for so long, the loop stands.
  // Errors: kCommandLine (not an address), kIo (in use, not permitted).
  static Result<std::unique_ptr<HttpServer>> start(
      const std::string& address,
      std::chrono::milliseconds stands_after = std::chrono::seconds(60));
  ~HttpServer();

  const std::string& url() const;  // "http://127.0.0.1:9464"
  bool loopback() const;
  void publish(const StatusReport& report);
  // Until the next publish(): what takes its time without turns of the loop ("writing").
  void enter(const std::string& state);

 private:
  struct State;
  explicit HttpServer(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace pvsfarm
