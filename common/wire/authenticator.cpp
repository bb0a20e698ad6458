#include "common/wire/authenticator.hpp"

#include <algorithm>
#include <array>
#include <vector>

#include "common/wire/despite_signals.hpp"

namespace pvsfarm {
namespace {

constexpr const char* kAnswers = "inproc://zeromq.zap.01";  // RFC 27
constexpr const char* kDomain = "pvsfarm";
// ZMQ_ZAP_ENFORCE_DOMAIN: behind the guard of drafts in 4.3, and accepted by number.
constexpr int kEnforceDomain = 93;

// The frames of a request, RFC 27.
enum RequestFrame { kVersion, kRequestId, kDomainName, kAddress, kIdentity, kMechanism, kKey };
constexpr std::size_t kRequestFrames = 7;

std::vector<std::string> receive_frames(zmq::socket_t& socket) {
  std::vector<std::string> frames;
  for (bool more = true; more;) {
    zmq::message_t part;
    if (!despite_signals([&] { return socket.recv(part); })) break;
    more = part.more();
    if (frames.size() <= kRequestFrames) frames.push_back(part.to_string());
  }
  return frames;
}

// The name of the key that asks, in digits; "" for anything but a proper question of CURVE.
std::string asking_key(const std::vector<std::string>& request) {
  KeyBytes key{};
  if (request.size() != kRequestFrames || request[kVersion] != "1.0" ||
      request[kDomainName] != kDomain || request[kMechanism] != "CURVE" ||
      request[kKey].size() != key.size())
    return "";
  std::copy(request[kKey].begin(), request[kKey].end(), key.begin());
  return hex_of(key);
}

std::string bytes_of(const KeyBytes& key) { return {key.begin(), key.end()}; }

}  // namespace

Authenticator::Authenticator(zmq::context_t& context, AllowList list)
    : list_(std::move(list)), context_(context), socket_(context, zmq::socket_type::rep) {
  socket_.set(zmq::sockopt::linger, 0);
  despite_signals([&] { socket_.bind(kAnswers); });
  thread_ = std::thread([this] { serve(); });
}

Authenticator::~Authenticator() {
  context_.shutdown();  // ends the wait for the next question
  thread_.join();
}

Role Authenticator::role_of(std::string_view hex) const {
  const std::lock_guard lock(mutex_);
  return list_.role_of(hex);
}

void Authenticator::replace(AllowList list) {
  const std::lock_guard lock(mutex_);
  list_ = std::move(list);
}

void Authenticator::serve() {
  try {
    while (true) {
      const std::vector<std::string> request = receive_frames(socket_);
      const std::string key = asking_key(request);
      const bool welcome = !key.empty() && role_of(key) != Role::kNone;
      const std::string id = request.size() > kRequestId ? request[kRequestId] : "";
      const std::array<std::string, 6> answer{
          "1.0", id, welcome ? "200" : "400", welcome ? "" : "no", welcome ? key : "", ""};
      for (std::size_t i = 0; i < answer.size(); ++i)
        despite_signals([&] {
          return socket_.send(zmq::buffer(answer[i]), i + 1 < answer.size()
                                                          ? zmq::send_flags::sndmore
                                                          : zmq::send_flags::none);
        });
    }
  } catch (const zmq::error_t&) {
    // The context ends. Were it anything else: with nobody to answer, nobody is let in.
    socket_.close();
  }
}

void require_keys(zmq::socket_t& socket, const KeyPair& server, bool enforce) {
  const int wanted = enforce ? 1 : 0;
  socket.set(zmq::sockopt::curve_server, true);
  socket.set(zmq::sockopt::curve_secretkey, bytes_of(server.secret));
  socket.set(zmq::sockopt::zap_domain, kDomain);
  if (zmq_setsockopt(socket.handle(), kEnforceDomain, &wanted, sizeof wanted) != 0)
    throw zmq::error_t();
}

void present_key(zmq::socket_t& socket, const ClientSecurity& security) {
  socket.set(zmq::sockopt::curve_serverkey, bytes_of(security.server));
  socket.set(zmq::sockopt::curve_publickey, bytes_of(security.keys.public_key));
  socket.set(zmq::sockopt::curve_secretkey, bytes_of(security.keys.secret));
}

}  // namespace pvsfarm
