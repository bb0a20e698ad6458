// Answers ZeroMQ's question whether a key may come in (ZAP, RFC 27). Only common/wire includes
// this.
//
// libzmq lets every key in while nobody answers, unless ZMQ_ZAP_ENFORCE_DOMAIN is set: so both, and
// a trial (trial.hpp).
// Threads: it has one of its own; members may be called from any.
#pragma once

#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <zmq.hpp>

#include "common/wire/keys.hpp"

namespace pvsfarm {

class Authenticator {
 public:
  // Before any socket of `context` is bound. `context` outlives it.
  Authenticator(zmq::context_t& context, AllowList list);
  ~Authenticator();  // ends the context's sockets: they must be closed before
  Authenticator(const Authenticator&) = delete;
  Authenticator& operator=(const Authenticator&) = delete;

  Role role_of(std::string_view hex) const;
  void replace(AllowList list);

 private:
  void serve();

  mutable std::mutex mutex_;
  AllowList list_;
  zmq::context_t& context_;
  zmq::socket_t socket_;
  std::thread thread_;
};

// Makes `socket` ask for keys, and refuse all while nobody answers for them.
void require_keys(zmq::socket_t& socket, const KeyPair& server, bool enforce = true);
void present_key(zmq::socket_t& socket, const ClientSecurity& security);

}  // namespace pvsfarm
