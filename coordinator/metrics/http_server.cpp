#include "coordinator/metrics/http_server.hpp"

#include <arpa/inet.h>
#include <microhttpd.h>
#include <netinet/in.h>

#include <cerrno>
#include <charconv>
#include <cstring>
#include <mutex>
#include <optional>

#include "coordinator/metrics/metrics.hpp"

namespace pvsfarm {
namespace {

using Clock = std::chrono::steady_clock;
constexpr unsigned kMaxConnections = 16;
constexpr unsigned kTimeout_s = 10;  // of a silent connection
constexpr std::size_t kConnectionBytes = 16 * 1024;
constexpr unsigned kOk = MHD_HTTP_OK, kUnavailable = MHD_HTTP_SERVICE_UNAVAILABLE;

struct Address {
  sockaddr_storage storage{};
  bool six = false, loopback = false;
  std::string host;
  std::uint16_t port = 0;
};

std::optional<std::uint16_t> port_in(std::string_view text) {
  std::uint16_t port = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), port);
  if (text.empty() || error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return port;
}

std::optional<Address> parse(const std::string& text) {
  Address address{.host = "127.0.0.1"};
  const std::size_t colon = text.rfind(':');
  if (colon != std::string::npos) address.host = text.substr(0, colon);
  const auto port =
      port_in(std::string_view(text).substr(colon == std::string::npos ? 0 : colon + 1));
  if (!port) return std::nullopt;
  address.port = *port;
  if (address.host == "localhost") address.host = "127.0.0.1";
  address.six =
      address.host.size() > 2 && address.host.front() == '[' && address.host.back() == ']';
  if (address.six) {
    auto& in6 = reinterpret_cast<sockaddr_in6&>(address.storage);
    in6.sin6_family = AF_INET6;
    in6.sin6_port = htons(*port);
    const std::string host = address.host.substr(1, address.host.size() - 2);
    if (inet_pton(AF_INET6, host.c_str(), &in6.sin6_addr) != 1) return std::nullopt;
    address.loopback = IN6_IS_ADDR_LOOPBACK(&in6.sin6_addr);
  } else {
    auto& in = reinterpret_cast<sockaddr_in&>(address.storage);
    in.sin_family = AF_INET;
    in.sin_port = htons(*port);
    if (inet_pton(AF_INET, address.host.c_str(), &in.sin_addr) != 1) return std::nullopt;
    address.loopback = ntohl(in.sin_addr.s_addr) >> 24 == 127;
  }
  return address;
}

struct Answer {
  unsigned status = kOk;
  std::string body;
  const char* type = "text/plain; charset=utf-8";
};

}  // namespace

struct HttpServer::State {
  MHD_Daemon* daemon = nullptr;
  std::string url;
  bool loopback = false;
  std::chrono::milliseconds stands_after{};

  std::mutex mutex;
  // Guarded by the mutex; a report is never changed once it is here.
  std::shared_ptr<const StatusReport> report = std::make_shared<const StatusReport>();
  Clock::time_point published = Clock::now();
  bool looping = false;

  ~State() {
    if (daemon != nullptr) MHD_stop_daemon(daemon);
  }
  void set(std::shared_ptr<const StatusReport> next, bool in_loop) {
    const std::lock_guard lock(mutex);
    report = std::move(next);
    published = Clock::now();
    looping = in_loop;
  }
  Answer answer(std::string_view path);
};

Answer HttpServer::State::answer(std::string_view path) {
  std::unique_lock lock(mutex);
  const std::shared_ptr<const StatusReport> now = report;
  const auto age = Clock::now() - published;
  const bool turning = looping;
  lock.unlock();
  if (path == "/metrics")
    return {kOk, metrics_text(*now, process_figures()), "text/plain; version=0.0.4; charset=utf-8"};
  const bool stands = turning && age > stands_after;
  const auto age_s = std::chrono::duration_cast<std::chrono::seconds>(age).count();
  if (path == "/healthz") {
    if (!stands) return {kOk, "ok: " + now->state + '\n'};
    return {kUnavailable, "the loop has not turned for " + std::to_string(age_s) + " s\n"};
  }
  if (path == "/readyz") return {turning && !stands ? kOk : kUnavailable, now->state + '\n'};
  return {MHD_HTTP_NOT_FOUND, "here are /metrics, /healthz and /readyz\n"};
}

namespace {

MHD_Result respond(MHD_Connection* connection, const Answer& answer) {
  MHD_Response* response = MHD_create_response_from_buffer(
      answer.body.size(), const_cast<char*>(answer.body.data()), MHD_RESPMEM_MUST_COPY);
  MHD_add_response_header(response, MHD_HTTP_HEADER_CONTENT_TYPE, answer.type);
  if (answer.status == MHD_HTTP_METHOD_NOT_ALLOWED)
    MHD_add_response_header(response, MHD_HTTP_HEADER_ALLOW, "GET, HEAD");
  const MHD_Result queued = MHD_queue_response(connection, answer.status, response);
  MHD_destroy_response(response);
  return queued;
}

template <class State>
MHD_Result on_request(void* context, MHD_Connection* connection, const char* url,
                      const char* method, const char*, const char*, std::size_t*, void**) {
  const std::string_view asked = method;
  if (asked != MHD_HTTP_METHOD_GET && asked != MHD_HTTP_METHOD_HEAD)
    return respond(connection, {MHD_HTTP_METHOD_NOT_ALLOWED, "only GET\n"});
  return respond(connection, static_cast<State*>(context)->answer(url));
}

}  // namespace

HttpServer::HttpServer(std::unique_ptr<State> state) : state_(std::move(state)) {}
HttpServer::~HttpServer() = default;

Result<std::unique_ptr<HttpServer>> HttpServer::start(const std::string& text,
                                                      std::chrono::milliseconds stands_after) {
  const std::optional<Address> address = parse(text);
  if (!address)
    return Error{ErrorKind::kCommandLine,
                 text + ": not an address to answer on; PORT, or 127.0.0.1:PORT, or [::1]:PORT"};
  auto state = std::make_unique<State>();
  state->stands_after = stands_after;
  state->loopback = address->loopback;
  process_figures();  // now is the start
  const unsigned flags =
      MHD_USE_INTERNAL_POLLING_THREAD | (address->six ? unsigned{MHD_USE_IPv6} : 0u);
  errno = 0;
  state->daemon = MHD_start_daemon(
      flags, address->port, nullptr, nullptr, on_request<State>, state.get(), MHD_OPTION_SOCK_ADDR,
      reinterpret_cast<const sockaddr*>(&address->storage), MHD_OPTION_CONNECTION_LIMIT,
      kMaxConnections, MHD_OPTION_CONNECTION_TIMEOUT, kTimeout_s,
      MHD_OPTION_CONNECTION_MEMORY_LIMIT, kConnectionBytes, MHD_OPTION_END);
  if (state->daemon == nullptr)
    return io_error(text + ": cannot answer there: " +
                    (errno != 0 ? std::strerror(errno) : "no listening socket"));
  const MHD_DaemonInfo* bound = MHD_get_daemon_info(state->daemon, MHD_DAEMON_INFO_BIND_PORT);
  state->url = "http://" + address->host + ':' +
               std::to_string(bound == nullptr ? address->port : bound->port);
  std::unique_ptr<HttpServer> server(new HttpServer(std::move(state)));
  server->enter("starting");
  return server;
}

const std::string& HttpServer::url() const { return state_->url; }
bool HttpServer::loopback() const { return state_->loopback; }

void HttpServer::publish(const StatusReport& report) {
  state_->set(std::make_shared<const StatusReport>(report), true);
}

void HttpServer::enter(const std::string& name) {
  StatusReport report = *state_->report;  // only this thread replaces it
  report.state = name;
  state_->set(std::make_shared<const StatusReport>(std::move(report)), false);
}

}  // namespace pvsfarm
