#include "tests/farm/durable_farm.hpp"

#include <cstdio>

namespace pvsfarm {
namespace fs = std::filesystem;

namespace {
const std::string kPvsfarm = PVSFARM_BIN_DIR "/pvsfarm";
}  // namespace

std::string DurableFarm::suite_, DurableFarm::golden_;
std::uint32_t DurableFarm::objects_ = 0, DurableFarm::cells_ = 0;

std::vector<std::string> DurableFarm::command(const std::string& out, const std::string& endpoint,
                                              const std::vector<std::string>& more) {
  std::vector<std::string> words{kPvsfarm,
                                 "coordinate",
                                 suite_ + "/city.obj",
                                 "--cells",
                                 suite_ + "/city.cells.json",
                                 "--tags",
                                 suite_ + "/city.tags.json",
                                 "--budget",
                                 "1",
                                 "--min-cell",
                                 "1.5",
                                 "--split-gain",
                                 "0",
                                 "--merge-tolerance",
                                 "-1",
                                 "--json",
                                 "-o",
                                 out,
                                 "--bind",
                                 endpoint};
  words.insert(words.end(), more.begin(), more.end());
  return words;
}

void DurableFarm::SetUpTestSuite() {
  std::string pattern = testing::TempDir() + "durable-XXXXXX";
  suite_ = mkdtemp(pattern.data());
  setenv("TMPDIR", suite_.c_str(), 1);
  Process generate({kPvsfarm, "generate", "city", "--blocks", "2", "--cell-size", "6", "-o",
                    suite_ + "/city.obj"},
                   suite_ + "/generate");
  ASSERT_EQ(generate.wait(), 0) << generate.err();
  // "city.obj: 228 objects, 4616 triangles, 912 cells"
  const std::string said = generate.out() + generate.err();
  ASSERT_EQ(std::sscanf(said.c_str() + said.find("city.obj: "), "city.obj: %u objects", &objects_),
            1)
      << said;
  const std::string endpoint = "ipc://" + suite_ + "/golden";
  Process golden(command(suite_ + "/golden.pvs", endpoint), suite_ + "/golden");
  const InstantWorkers workers(endpoint, work(0));
  ASSERT_EQ(golden.wait(), 0) << golden.err();
  golden_ = read_file(suite_ + "/golden.pvs").value();
  cells_ = static_cast<std::uint32_t>(workers.figures().acknowledged);
}

void DurableFarm::SetUp() {
  std::string pattern = suite_ + "/t-XXXXXX";
  folder_ = mkdtemp(pattern.data());
  setenv("TMPDIR", folder_.c_str(), 1);
  fs::create_directory(folder_ + "/out");
  out_ = folder_ + "/out/city.pvs";
}

std::unique_ptr<Process> DurableFarm::coordinate(const std::string& fault,
                                                 std::uint64_t seed) const {
  std::vector<std::string> words;
  if (!fault.empty())
    words = {"/usr/bin/env", "LD_PRELOAD=" PVSFARM_FAULTY_DISK,
             "PVSFARM_DISK_FOLDER=" + fs::path(out_).parent_path().string(),
             "PVSFARM_DISK_FAULT=" + fault, "PVSFARM_DISK_SEED=" + std::to_string(seed)};
  const std::vector<std::string> rest = command(out_, endpoint());
  words.insert(words.end(), rest.begin(), rest.end());
  return std::make_unique<Process>(words, folder_ + "/coordinator");
}

bool DurableFarm::golden() const {
  const auto bytes = read_file(out_);
  return bytes && *bytes == golden_ && !fs::exists(out_ + ".journal");
}

double DurableFarm::fault_s(const Process& process) {
  const std::string out = process.out();
  const std::size_t at = out.find("fault ");
  return at == std::string::npos ? 0 : std::stod(out.substr(at + 6)) / 1e3;
}

}  // namespace pvsfarm
