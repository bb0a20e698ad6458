// Keys, their files, the list of those that are let in, and what each role may say.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>

#include "common/base/file.hpp"
#include "common/wire/codec.hpp"
#include "common/wire/keys.hpp"

namespace pvsfarm {
namespace {

namespace fs = std::filesystem;

class KeyFiles : public testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = testing::TempDir() + "keys-XXXXXX";
    folder_ = mkdtemp(pattern.data());
  }
  void TearDown() override { fs::remove_all(folder_); }
  std::string path(const char* name) const { return folder_ + "/" + name; }
  void write(const std::string& to, const std::string& text) { std::ofstream(to) << text; }

  std::string folder_;
};

TEST_F(KeyFiles, a_key_comes_back_from_its_file_and_only_its_owner_reads_it) {
  const KeyPair keys = make_key_pair();
  const mode_t before = umask(0);
  const Status written = write_key_file(path("key"), keys);
  umask(before);
  ASSERT_TRUE(written.ok());
  struct stat info {};
  ASSERT_EQ(stat(path("key").c_str(), &info), 0);
  EXPECT_EQ(info.st_mode & 0777, 0600u);
  const Result<KeyPair> back = read_key_file(path("key"));
  ASSERT_TRUE(back.ok()) << back.error().text;
  EXPECT_EQ(back->public_key, keys.public_key);
  EXPECT_EQ(back->secret, keys.secret);
}

TEST_F(KeyFiles, a_key_is_never_written_over_another_nor_through_a_link) {
  ASSERT_TRUE(write_key_file(path("key"), make_key_pair()).ok());
  const std::string before = read_file(path("key")).value();
  const Status again = write_key_file(path("key"), make_key_pair());
  ASSERT_FALSE(again.ok());
  EXPECT_EQ(again.error().kind, ErrorKind::kInvalidInput);
  EXPECT_EQ(read_file(path("key")).value(), before);
  fs::create_symlink(path("elsewhere"), path("link"));
  EXPECT_FALSE(write_key_file(path("link"), make_key_pair()).ok());
  EXPECT_FALSE(fs::exists(path("elsewhere")));
}

TEST_F(KeyFiles, a_private_key_that_everybody_may_read_is_not_used) {
  ASSERT_TRUE(write_key_file(path("key"), make_key_pair()).ok());
  for (const auto& [mode, fine] : {std::pair{0600, true},
                                   {0400, true},
                                   {0440, true},
                                   {0644, false},
                                   {0660, false},
                                   {0602, false}}) {
    ASSERT_EQ(chmod(path("key").c_str(), static_cast<mode_t>(mode)), 0);
    EXPECT_EQ(read_key_file(path("key")).ok(), fine) << std::oct << mode;
  }
}

TEST_F(KeyFiles, a_damaged_private_key_is_refused_at_every_character) {
  ASSERT_TRUE(write_key_file(path("key"), make_key_pair()).ok());
  const std::string good = read_file(path("key")).value();
  chmod(path("key").c_str(), 0600);
  const std::size_t secret = good.find("secret ") + 7;
  for (std::size_t i = 0; i + 1 < good.size(); ++i) {
    // Curve25519 does not look at some bits of these two digits: it is the same key.
    if (i == secret + 1 || i == secret + 62) continue;
    std::string bad = good;
    bad[i] = bad[i] == '5' ? '6' : '5';
    write(path("key"), bad);
    EXPECT_FALSE(read_key_file(path("key")).ok()) << "character " << i;
  }
  for (std::size_t length = 0; length + 1 < good.size(); ++length) {
    write(path("key"), good.substr(0, length));
    EXPECT_FALSE(read_key_file(path("key")).ok()) << "length " << length;
  }
}

TEST_F(KeyFiles, a_public_key_is_given_in_digits_or_by_a_file) {
  const KeyPair keys = make_key_pair();
  const std::string digits = hex_of(keys.public_key);
  EXPECT_EQ(read_public_key(digits).value(), keys.public_key);
  for (const std::string& text :
       {digits + "\n", "# farm\n\n" + digits, "worker " + digits + " w"}) {
    write(path("pub"), text);
    EXPECT_EQ(read_public_key(path("pub")).value(), keys.public_key) << text;
  }
  write(path("pub"), "secret " + digits);
  EXPECT_FALSE(read_public_key(path("pub")).ok());
  EXPECT_FALSE(read_public_key(digits.substr(1)).ok());
  EXPECT_FALSE(read_public_key(path("none")).ok());
}

TEST(AllowList, lines_give_roles) {
  const std::string a(64, 'a'), b(64, 'b'), c(64, 'c'), d(64, 'd');
  const auto list = AllowList::parse("# the farm\n\n worker " + a + "  rack 3, left \r\nadmin\t" +
                                         b + "\nviewer " + std::string(64, 'C') + "\n",
                                     "list");
  ASSERT_TRUE(list.ok()) << list.error().text;
  EXPECT_EQ(list->size(), 3u);
  EXPECT_EQ(list->role_of(a), Role::kWorker);
  EXPECT_EQ(list->role_of(b), Role::kAdmin);
  EXPECT_EQ(list->role_of(c), Role::kViewer);
  EXPECT_EQ(list->role_of(d), Role::kNone);
  EXPECT_EQ(list->role_of(""), Role::kNone);
}

TEST(AllowList, a_line_that_is_not_understood_refuses_the_whole_list_and_is_named) {
  const std::string key(64, 'a');
  for (const std::string& bad :
       {"worker " + key.substr(1), "root " + key, "local " + key, "none " + key,
        std::string("worker"), key, "Worker " + key, "worker " + key + "a", "admin " + key}) {
    const auto list = AllowList::parse("worker " + key + "\n" + bad, "farm.allow");
    ASSERT_FALSE(list.ok()) << bad;
    EXPECT_EQ(list.error().text.rfind("farm.allow, line 2: ", 0), 0u) << list.error().text;
  }
}

TEST_F(KeyFiles, a_list_that_others_may_write_is_not_used) {
  write(path("allow"), "worker " + std::string(64, 'a'));
  ASSERT_EQ(chmod(path("allow").c_str(), 0644), 0);
  EXPECT_TRUE(AllowList::read(path("allow")).ok());
  ASSERT_EQ(chmod(path("allow").c_str(), 0664), 0);
  EXPECT_FALSE(AllowList::read(path("allow")).ok());
  EXPECT_FALSE(AllowList::read(folder_).ok());
}

template <std::size_t... I>
std::vector<Message> one_of_each(std::index_sequence<I...>) {
  return {Message(std::in_place_index<I>)...};
}

TEST(Roles, every_message_is_allowed_to_those_alone_who_need_it) {
  const auto may = [](Role role) {
    std::string names;
    for (const Message& m : one_of_each(std::make_index_sequence<std::variant_size_v<Message>>()))
      if (permits(role, m)) names += type_name(m) + " ";
    return names;
  };
  const std::string worker =
      "HELLO HEARTBEAT RESULT_BEGIN RESULT_CHUNK RESULT_END TASK_FAILED BLOB_GET DRAINING BYE ";
  EXPECT_EQ(may(Role::kNone), "");
  EXPECT_EQ(may(Role::kViewer), "STATUS_GET ");
  EXPECT_EQ(may(Role::kAdmin), "STATUS_GET CONTROL ");
  EXPECT_EQ(may(Role::kWorker), worker + "FINDING_BEGIN ");
  // Whoever reaches an endpoint without keys still cannot send a coordinator its own messages.
  EXPECT_EQ(may(Role::kLocal), worker + "STATUS_GET CONTROL FINDING_BEGIN ");
}

}  // namespace
}  // namespace pvsfarm
