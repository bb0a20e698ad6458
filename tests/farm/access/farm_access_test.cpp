// Who gets into a farm, and what they can do there: keys that are unknown, revoked, missing, of
// another mechanism, or of another role than what they ask for. Row 19 of the fault table.
#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <atomic>
#include <filesystem>
#include <fstream>

#include "common/wire/socket.hpp"
#include "common/wire/trial.hpp"
#include "tests/farm/access/raw_peer.hpp"
#include "tests/farm/process.hpp"
#include "tests/support/fault_figures.hpp"

namespace pvsfarm {
namespace {

namespace fs = std::filesystem;
using std::chrono::milliseconds;

// A Router that answers what roles permit, in a thread of its own; and counts.
class Doorman {
 public:
  explicit Doorman(const std::string& allowed) {
    auto list = AllowList::parse(allowed, "list");
    auto router = Router::bind("tcp://127.0.0.1:*", ServerSecurity{keys_, std::move(*list)});
    if (!router) ADD_FAILURE() << router.error().text;
    router_ = std::move(router).value();
    endpoint_ = router_->endpoint();
    thread_ = std::thread([this] { serve(); });
  }
  ~Doorman() {
    stop_ = true;
    thread_.join();
  }

  const std::string& endpoint() const { return endpoint_; }
  const KeyBytes& key() const { return keys_.public_key; }
  // Messages that came through to be dealt with.
  unsigned permitted() const { return permitted_; }
  unsigned forbidden() const { return forbidden_; }
  // Connections cut by the new list.
  unsigned allow(const std::string& text) {
    next_ = std::make_unique<AllowList>(AllowList::parse(text, "list").value());
    changed_ = false;
    change_ = true;
    EXPECT_TRUE(wait_until(5, [&] { return changed_.load(); }));
    return cut_;
  }

 private:
  void serve() {
    while (!stop_) {
      router_->wait(milliseconds(5));
      if (change_) {
        cut_ = static_cast<unsigned>(router_->allow(std::move(*next_)).size());
        change_ = false;
        changed_ = true;
      }
      while (const auto received = router_->receive()) {
        if (received->decoded && permits(received->role, received->decoded->message)) {
          ++permitted_;
          router_->send(received->peer, {}, ControlAck{});
        } else {
          ++forbidden_;
          router_->send(received->peer, {}, Reject{RejectCode::kForbidden, "no"});
        }
      }
    }
  }

  KeyPair keys_ = make_key_pair();
  std::unique_ptr<Router> router_;
  std::string endpoint_;
  std::unique_ptr<AllowList> next_;
  std::atomic<bool> stop_{false}, change_{false}, changed_{false};
  std::atomic<unsigned> permitted_{0}, forbidden_{0}, cut_{0};
  std::thread thread_;
};

// What a peer with these keys gets for a message: an answer's type, or how the handshake ended.
std::string try_to_say(const Doorman& door, const std::optional<KeyPair>& keys,
                       const Message& message, const KeyBytes& server) {
  std::optional<ClientSecurity> security;
  if (keys) security = ClientSecurity{*keys, server};
  const auto dealer = Dealer::connect(door.endpoint(), security).value();
  dealer->send({}, message);
  std::string answer = "silence";
  wait_until(10, [&] {
    dealer->wait(milliseconds(2));
    if (const auto received = dealer->receive())
      answer = received->decoded ? type_name(received->decoded->message) : "damage";
    else if (const auto handshake = dealer->handshake(); handshake != Dealer::Handshake::kFine)
      answer = handshake == Dealer::Handshake::kRefused ? "refused"
               : handshake == Dealer::Handshake::kOther ? "other mechanism"
                                                        : "hung up";
    return answer != "silence";
  });
  return answer;
}

std::string line(const char* role, const KeyPair& keys) {
  return std::string(role) + " " + hex_of(keys.public_key) + "\n";
}

unsigned tries() { return full_counts() ? 1000 : 60; }

void record_attempts(const std::string& what, unsigned accepted) {
  record({.row = 19,
          .what = what + " accepted, of " + std::to_string(tries()) + " tries",
          .asked = "0",
          .reached = std::to_string(accepted),
          .held = accepted == 0});
}

TEST(Access, an_allowed_key_comes_in_with_its_role) {
  const KeyPair worker = make_key_pair(), admin = make_key_pair(), viewer = make_key_pair();
  const Doorman door(line("worker", worker) + line("admin", admin) + line("viewer", viewer));
  EXPECT_EQ(try_to_say(door, worker, Bye{}, door.key()), "CONTROL_ACK");
  EXPECT_EQ(try_to_say(door, admin, Control{}, door.key()), "CONTROL_ACK");
  EXPECT_EQ(try_to_say(door, viewer, StatusGet{}, door.key()), "CONTROL_ACK");
  EXPECT_EQ(door.permitted(), 3u);
}

TEST(Access, an_unknown_key_never_comes_in) {
  const Doorman door(line("worker", make_key_pair()));
  unsigned refused = 0;
  for (unsigned i = 0; i < tries(); ++i)
    refused += try_to_say(door, make_key_pair(), Bye{}, door.key()) == "refused" ? 1 : 0;
  EXPECT_EQ(refused, tries());
  EXPECT_EQ(door.permitted() + door.forbidden(), 0u);
  record_attempts("unknown keys", door.permitted() + door.forbidden() + tries() - refused);
}

TEST(Access, no_keys_or_the_mechanism_plain_never_come_in) {
  const Doorman door(line("worker", make_key_pair()));
  unsigned outside = 0;
  for (unsigned i = 0; i < tries(); ++i) {
    const std::string end = try_to_say(door, std::nullopt, Bye{}, door.key());
    outside += end == "other mechanism" || end == "hung up" ? 1 : 0;
  }
  EXPECT_EQ(outside, tries());
  record_attempts("peers without keys (NULL)", door.permitted() + tries() - outside);
  unsigned hung_up = 0;
  for (unsigned i = 0; i < tries(); ++i) {
    RawPeer peer(door.endpoint());
    peer.send(RawPeer::greeting("PLAIN"));
    peer.send(RawPeer::command("HELLO", std::string("\5admin\5admin")));
    peer.send(RawPeer::message({"header", "body"}));
    hung_up += peer.hangs_up(5) ? 1 : 0;
  }
  EXPECT_EQ(hung_up, tries());
  EXPECT_EQ(door.permitted() + door.forbidden(), 0u);
  record_attempts("peers with a password (PLAIN)", door.permitted() + tries() - hung_up);
}

TEST(Access, a_peer_that_expects_another_coordinator_is_not_connected) {
  const KeyPair worker = make_key_pair();
  const Doorman door(line("worker", worker));
  EXPECT_EQ(try_to_say(door, worker, Bye{}, make_key_pair().public_key), "hung up");
  EXPECT_EQ(door.permitted(), 0u);
}

TEST(Access, a_revoked_key_is_cut_and_does_not_come_back) {
  constexpr unsigned kTogether = 20;
  const KeyPair stays = make_key_pair();
  Doorman door(line("viewer", stays));
  unsigned cut = 0, refused = 0, accepted = 0;
  for (unsigned done = 0; done < tries(); done += kTogether) {
    std::vector<std::unique_ptr<Dealer>> dealers;
    std::vector<KeyPair> keys;
    std::string list = line("viewer", stays);
    for (unsigned i = 0; i < kTogether; ++i)
      list += line("worker", keys.emplace_back(make_key_pair()));
    door.allow(list);
    const unsigned before = door.permitted();
    for (const KeyPair& key : keys) {
      dealers.push_back(Dealer::connect(door.endpoint(), ClientSecurity{key, door.key()}).value());
      dealers.back()->send({}, Draining{});
    }
    const auto all = [&](const auto& reached) {
      std::vector<char> has(kTogether);
      return wait_until(20, [&] {
        unsigned count = 0;
        for (unsigned i = 0; i < kTogether; ++i) {
          dealers[i]->wait(milliseconds(1));
          count += (has[i] = has[i] || reached(*dealers[i])) ? 1 : 0;
        }
        return count == kTogether;
      });
    };
    ASSERT_TRUE(all([](Dealer& dealer) { return dealer.receive().has_value(); }));
    ASSERT_EQ(door.permitted() - before, kTogether);
    cut += door.allow(line("viewer", stays));
    for (const auto& dealer : dealers) dealer->send({}, Draining{});
    if (all([](Dealer& dealer) { return dealer.handshake() == Dealer::Handshake::kRefused; }))
      refused += kTogether;
    accepted += door.permitted() - before - kTogether;
  }
  EXPECT_EQ(cut, tries()) << "live connections";
  EXPECT_EQ(refused, tries());
  EXPECT_EQ(accepted, 0u);
  EXPECT_EQ(try_to_say(door, stays, StatusGet{}, door.key()), "CONTROL_ACK");
  record_attempts("messages and connections of revoked keys", accepted + tries() - refused);
}

TEST(Access, a_key_does_only_what_its_role_allows) {
  const KeyPair worker = make_key_pair(), admin = make_key_pair(), viewer = make_key_pair();
  const Doorman door(line("worker", worker) + line("admin", admin) + line("viewer", viewer));
  const auto dealer_of = [&](const KeyPair& keys) {
    return Dealer::connect(door.endpoint(), ClientSecurity{keys, door.key()}).value();
  };
  const auto dealers = {std::pair{dealer_of(worker).release(), Message(Control{})},
                        {dealer_of(worker).release(), Message(StatusGet{})},
                        {dealer_of(viewer).release(), Message(Control{ControlKind::kCancel})},
                        {dealer_of(viewer).release(), Message(Hello{})},
                        {dealer_of(admin).release(), Message(Hello{})},
                        {dealer_of(admin).release(), Message(ResultEnd{})}};
  unsigned rejected = 0, sent = 0;
  for (const auto& [raw, message] : dealers) {
    const std::unique_ptr<Dealer> dealer(raw);
    for (unsigned i = 0; i < tries(); ++i, ++sent) {
      dealer->send({}, message);
      std::optional<Received> answer;
      ASSERT_TRUE(wait_until(5, [&] {
        dealer->wait(milliseconds(2));
        return (answer = dealer->receive()).has_value();
      }));
      rejected += std::holds_alternative<Reject>(answer->decoded->message) ? 1 : 0;
    }
  }
  EXPECT_EQ(rejected, sent);
  EXPECT_EQ(door.permitted(), 0u);
  record_attempts("messages beyond their key's role, six kinds, each", door.permitted());
}

TEST(Access, without_keys_only_this_machine_is_listened_to) {
  for (const char* endpoint :
       {"tcp://0.0.0.0:0", "tcp://*:*", "tcp://[::]:0", "tcp://10.0.0.1:0", "tcp://127.org:0"}) {
    const auto router = Router::bind(endpoint);
    ASSERT_FALSE(router.ok()) << endpoint;
    EXPECT_EQ(router.error().kind, ErrorKind::kUnsupported) << endpoint;
  }
  EXPECT_TRUE(Router::bind("tcp://127.0.0.1:*").ok());
  const auto guarded = Router::bind("tcp://0.0.0.0:*", ServerSecurity{make_key_pair(), {}});
  EXPECT_TRUE(guarded.ok()) << guarded.error().text;
}

// libzmq lets every key in while nobody answers its question: here nobody does.
TEST(Access, while_nobody_answers_for_the_keys_nobody_comes_in) {
  const Status open = try_in_vain(TrialDoor{.answers = false, .enforces = false});
  ASSERT_FALSE(open.ok()) << "the trial did not notice an open door";
  EXPECT_EQ(open.error().kind, ErrorKind::kRuntime);
  unsigned let_in = 0;
  const unsigned count = full_counts() ? 1000 : 20;
  for (unsigned i = 0; i < count; ++i)
    let_in += try_in_vain(TrialDoor{.answers = false}).ok() ? 0 : 1;
  EXPECT_EQ(let_in, 0u);
  EXPECT_TRUE(try_in_vain(TrialDoor{}).ok());
  record({.row = 19,
          .what = "strange keys accepted while no handler answers, of " + std::to_string(count) +
                  " starts; and a start whose door is open is refused",
          .asked = "0, refused",
          .reached = std::to_string(let_in) + (open.ok() ? ", not refused" : ", refused"),
          .held = let_in == 0 && !open.ok()});
}

}  // namespace
}  // namespace pvsfarm
