// One request over HTTP/1.1, for tests of the coordinator's health and figures.
#pragma once

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstdint>
#include <string>

namespace pvsfarm {

struct HttpAnswer {
  int status = 0;  // 0: nobody answers
  std::string head, body;
};

// `url`: http://127.0.0.1:PORT/PATH
inline HttpAnswer http_get(const std::string& url, const std::string& method = "GET") {
  const std::string rest = url.substr(std::string("http://127.0.0.1:").size());
  const std::size_t slash = rest.find('/');
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(std::stoi(rest.substr(0, slash))));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  const int fd = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  timeval patience{5, 0};
  setsockopt(fd, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
  std::string answer;
  if (connect(fd, reinterpret_cast<sockaddr*>(&address), sizeof address) == 0) {
    const std::string request = method + " " + rest.substr(slash) +
                                " HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n";
    [[maybe_unused]] const ssize_t sent = send(fd, request.data(), request.size(), MSG_NOSIGNAL);
    char buffer[4096];
    for (ssize_t n = 0; (n = recv(fd, buffer, sizeof buffer, 0)) > 0;)
      answer.append(buffer, static_cast<std::size_t>(n));
  }
  close(fd);
  const std::size_t end = answer.find("\r\n\r\n");
  if (answer.rfind("HTTP/1.1 ", 0) != 0 || end == std::string::npos) return {};
  return {std::stoi(answer.substr(9)), answer.substr(0, end), answer.substr(end + 4)};
}

}  // namespace pvsfarm
