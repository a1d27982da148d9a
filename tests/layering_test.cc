// The rules of docs/architecture.md over #include lines: who may depend on whom, and the one home
// of each third party. A message names file, line and rule.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <set>
#include <sstream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"

namespace liquidblend {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

struct SourceFile {
  std::string path;  // from the repository's root
  std::string text;
};

struct Include {
  const SourceFile* file = nullptr;
  int line = 0;
  std::string target;  // as written between the quotes or brackets
  bool is_quoted = false;
};

// Paths that start with one of these, files included.
using Places = std::vector<std::string_view>;

bool StartsWith(std::string_view text, std::string_view prefix) {
  return text.substr(0, prefix.size()) == prefix;
}

bool IsIn(std::string_view path, const Places& places) {
  return std::any_of(places.begin(), places.end(),
                     [&](std::string_view place) { return StartsWith(path, place); });
}

// Rule 1: what the files of each top folder may include of ours.
const std::map<std::string_view, Places> kTopFolders = {
    {"core/", {"core/", "liquidblend/v1/", "liquidblend/store/v1/"}},
    {"worker/", {"worker/", "core/", "liquidblend/v1/", "liquidblend/store/v1/"}},
    {"server/", {"server/", "core/", "liquidblend/v1/", "liquidblend/store/v1/"}},
    {"client/", {"client/", "liquidblend/"}},
    {"tests/", {"core/", "worker/", "server/", "client/", "tests/", "liquidblend/"}},
};
// What core has for liquidblend, the client's program, too. The client's library has no part of
// core: it is installed without. The player makes frames of a family's file by itself.
const Places kForAllPrograms = {"core/base/cores.h", "core/base/nearest.h", "core/base/version.h",
                                "core/mesh/registration_options.h", "core/trace/"};
const Places kForPlayer = {"core/base/",        "core/parallel/",    "core/mesh/",
                           "core/store/blobs/", "core/store/files/", "core/parameters/",
                           "core/frames/"};
// Examples are built as users build theirs: of ours they include the header of the C API alone.
const Places kForExamples = {"liquidblend/liquidblend.h"};
const Places kOurs = {"core/", "worker/", "server/", "client/", "tests/", "liquidblend/"};

// Rule 2: a stage is included by itself and by the folder that calls the stages in order. The
// measurement of correspondences and frames of animations use single stages.
struct Stage {
  std::string_view folder;
  Places callers;
};
const Stage kStages[] = {{"worker/ingest/", {"worker/jobs/"}},
                         {"worker/spacetime/", {"worker/jobs/"}},
                         {"worker/registration/", {"worker/jobs/"}},
                         {"core/blend/", {"core/frames/", "server/frames/measure.cc"}},
                         {"core/slice/", {"core/frames/", "server/frames/measure.cc"}},
                         {"core/finish/", {"core/frames/", "server/frames/animation_frame.cc"}},
                         {"server/encode/", {"server/frames/"}}};

// Rule 3 does not hold for the homes that rule 4 gives to the log and to threads: they are core's.
const Places kCoreByDesign = {"core/base/", "core/parallel/"};

// Rule 4: the homes of third parties and generated code, the longest fitting prefix counts.
// Programs cannot share code with the client, so what both need has a home in each.
struct ThirdParty {
  std::string_view prefix;
  Places homes;
};
const Places kEverywhere = {""};
const Places kRpc = {"server/grpc/", "client/src/"};
const Places kMains = {"server/main.cc",       "server/flags.",  "server/store_flags.",
                       "server/admin/main.cc", "worker/main.cc", "client/cli/"};
const ThirdParty kThirdParties[] = {
    {"absl/", kEverywhere},
    {"Eigen/", {"core/", "worker/", "server/", "client/src/", "client/cli/"}},
    {"Eigen/Sparse", {"worker/registration/"}},
    {"Eigen/IterativeLinearSolvers", {"worker/registration/"}},
    {"Eigen/CholmodSupport", {"worker/registration/"}},
    {"nanoflann.hpp", {"worker/registration/"}},
    {"libqhull_r/", {"core/parameters/"}},
    {"hwy/", {"core/slice/"}},
    {"meshoptimizer.h", {"server/encode/", "client/src/"}},
    {"tbb/", {"core/parallel/"}},
    {"oneapi/", {"core/parallel/"}},
    {"spdlog/", {"core/base/"}},
    {"sqlite3.h", {"core/store/"}},
    {"pqxx/", {"core/store/"}},
    {"libpq-fe.h", {"core/store/"}},
    {"curl/", {"core/store/", "client/src/"}},
    {"pugixml.hpp", {"core/store/"}},
    {"archive.h", {"server/tar/"}},
    {"archive_entry.h", {"server/tar/"}},
    {"openssl/",
     {"core/store/", "client/cli/main.cc", "client/src/", "server/access/", "server/grpc/"}},
    {"xxhash.h", {"core/store/", "client/src/"}},
    {"openvdb/", {"worker/ingest/", "client/vdb/"}},
    {"blosc.h", {"worker/ingest/"}},
    {"zlib.h", {"worker/ingest/", "server/http/", "client/cli/"}},
    {"nlohmann/",
     {"core/base/", "core/store/", "core/trace/", "worker/ingest/", "worker/registration/",
      "server/admin/", "server/access/", "client/cli/"}},
    {"draco/", {"server/encode/", "client/src/"}},
    {"boost/", {"server/http/"}},
    {"jemalloc/", {"server/allocator.cc"}},
    {"prometheus/", {"server/metrics/"}},
    {"CLI/", kMains},
    {"embree3/", {"client/cli/"}},
    {"stb/", {"client/cli/", "client/examples/"}},
    {"GLFW/", {"client/examples/"}},
    {"epoxy/", {"client/examples/"}},
    {"grpc/", kRpc},
    {"grpcpp/", {"server/grpc/", "client/src/", "server/main.cc", "worker/main.cc"}},
    {"google/protobuf/",
     {"core/store/", "worker/jobs/", "server/catalog/", "server/base/", "server/access/",
      "server/frames/", "server/api/", "server/grpc/", "server/transcode/", "server/http/",
      "client/src/"}},
    {"google/api/", {"server/transcode/"}},
    {"google/rpc/",
     {"core/store/", "worker/jobs/", "server/base/", "server/api/", "server/grpc/", "client/src/"}},
    {"google/longrunning/", {"server/base/", "server/api/", "server/grpc/", "client/src/"}},
    {"liquidblend/v1/",
     {"server/base/", "server/access/", "server/encode/", "server/frames/", "server/api/",
      "server/grpc/", "server/http/", "client/src/"}},
    {"liquidblend/store/v1/",
     {"core/store/", "worker/jobs/", "server/catalog/", "server/access/", "server/frames/",
      "server/api/"}},
};

// Rule 5: the rooms of a folder, the lower ones first. Files of the folder itself are above them,
// and so is the main.cc of a room that is a program. tests/docs/check_pages.py compares this table
// with the one in docs/architecture.md.
struct Rooms {
  std::string_view folder;
  std::vector<std::string_view> rooms;
};
const Rooms kRooms[] = {
    {"core/",
     {"base/", "parallel/", "mesh/", "store/", "trace/", "parameters/", "slice/", "blend/",
      "finish/", "frames/"}},
    {"core/store/", {"sql/", "blobs/", "files/", "catalog/"}},
    {"client/", {"include/", "src/", "player/", "c/", "vdb/", "cli/", "examples/"}},
    {"client/src/", {"connection/", "decode/", "files/"}},
    {"client/cli/", {"flags/", "files/", "print/", "render/", "export/"}},
    {"server/",
     {"tar/", "admin/", "encode/", "metrics/", "catalog/", "base/", "access/", "frames/", "probes/",
      "api/", "grpc/", "transcode/", "http/"}},
    {"server/http/", {"exchange/", "answers/"}},
    {"worker/", {"ingest/", "spacetime/", "registration/", "jobs/"}},
    {"worker/ingest/", {"formats/", "clean/"}},
    {"worker/jobs/", {"attempt/"}},
    {"worker/registration/", {"surface/", "features/", "fit/", "finish/"}},
    {"worker/spacetime/", {"field/", "nets/", "sheets/", "tracked/"}}};

// Rule 6: the most sources and headers that a folder may hold.
constexpr size_t kMaxFilesPerFolder = 40;

// The system's own headers; C++'s have neither a dot nor a slash.
const std::set<std::string_view> kSystem = {
    "dirent.h",      "dlfcn.h",       "errno.h",      "fcntl.h",        "fnmatch.h",
    "malloc.h",      "poll.h",        "pthread.h",    "sched.h",        "signal.h",
    "spawn.h",       "stddef.h",      "stdint.h",     "termios.h",      "unistd.h",
    "netdb.h",       "emmintrin.h",   "xmmintrin.h",  "sys/file.h",     "sys/ioctl.h",
    "sys/mman.h",    "sys/prctl.h",   "sys/random.h", "sys/resource.h", "sys/socket.h",
    "sys/stat.h",    "sys/statvfs.h", "sys/types.h",  "sys/wait.h",     "netinet/in.h",
    "netinet/tcp.h", "arpa/inet.h",   "ifaddrs.h"};

// The headers of C that an example needs.
const std::set<std::string_view> kC = {"getopt.h", "math.h",  "stdbool.h", "stddef.h",
                                       "stdint.h", "stdio.h", "stdlib.h",  "string.h"};

bool IsCpp(std::string_view target) { return target.find_first_of("./") == std::string_view::npos; }

bool IsGenerated(std::string_view target) { return absl::EndsWith(std::string(target), ".pb.h"); }

std::vector<Include> FindIncludes(const SourceFile& file) {
  std::vector<Include> includes;
  std::istringstream lines(file.text);
  std::string line;
  for (int number = 1; std::getline(lines, line); ++number) {
    std::string_view rest = line;
    const auto skip_blanks = [&] {
      rest.remove_prefix(std::min(rest.find_first_not_of(" \t"), rest.size()));
    };
    const auto skip = [&](std::string_view word) {
      skip_blanks();
      if (!StartsWith(rest, word)) return false;
      rest.remove_prefix(word.size());
      return true;
    };
    if (!skip("#") || !skip("include")) continue;
    skip_blanks();
    if (rest.empty() || (rest[0] != '"' && rest[0] != '<')) continue;
    const bool is_quoted = rest[0] == '"';
    const size_t end = rest.find(is_quoted ? '"' : '>', 1);
    if (end == std::string_view::npos) continue;
    includes.push_back({&file, number, std::string(rest.substr(1, end - 1)), is_quoted});
  }
  return includes;
}

const ThirdParty* FindThirdParty(std::string_view target) {
  const ThirdParty* found = nullptr;
  for (const ThirdParty& party : kThirdParties) {
    if (!StartsWith(target, party.prefix)) continue;
    if (found == nullptr || party.prefix.size() > found->prefix.size()) found = &party;
  }
  return found;
}

// The place of a file among the rooms of its folder.
size_t RoomOf(std::string_view path, const Rooms& rooms) {
  if (absl::EndsWith(std::string(path), "/main.cc")) return rooms.rooms.size();
  const std::string_view rest = path.substr(rooms.folder.size());
  const auto room = std::find_if(rooms.rooms.begin(), rooms.rooms.end(),
                                 [&](std::string_view name) { return StartsWith(rest, name); });
  return room - rooms.rooms.begin();
}

bool LeadsUpwards(std::string_view path, std::string_view target) {
  return std::any_of(std::begin(kRooms), std::end(kRooms), [&](const Rooms& rooms) {
    return StartsWith(path, rooms.folder) && StartsWith(target, rooms.folder) &&
           RoomOf(target, rooms) > RoomOf(path, rooms);
  });
}

// Whether an example may include it: its own headers, the public one, C's, and third parties.
bool IsForExample(const Include& include) {
  const bool is_own = include.is_quoted && include.target.find('/') == std::string::npos;
  return is_own || IsIn(include.target, kForExamples) || kC.contains(include.target);
}

// What is wrong with one include, or nothing.
std::string Fault(const Include& include) {
  const std::string_view path = include.file->path;
  const std::string_view target = include.target;
  if (StartsWith(path, "client/examples/")) {
    if (IsForExample(include)) return "";
    if (IsIn(target, kOurs)) return "rule 1: an example includes liquidblend/liquidblend.h alone";
  }
  const bool is_for_all = (StartsWith(path, "client/cli/") && IsIn(target, kForAllPrograms)) ||
                          (IsIn(path, {"client/player/", "client/c/"}) && IsIn(target, kForPlayer));
  for (const auto& [folder, allowed] : kTopFolders) {
    if (!is_for_all && StartsWith(path, folder) && IsIn(target, kOurs) && !IsIn(target, allowed)) {
      return absl::StrCat("rule 1: ", std::string(folder), " may not depend on it");
    }
  }
  if (StartsWith(path, "client/include/") &&
      (IsGenerated(target) || StartsWith(target, "Eigen/"))) {
    return "rule 4: client/include/ holds neither generated code nor Eigen";
  }
  if (StartsWith(path, "tests/")) return "";
  if (LeadsUpwards(path, target)) return "rule 5: it is in a higher room";
  for (const Stage& stage : kStages) {
    if (!StartsWith(target, stage.folder) || StartsWith(path, stage.folder)) continue;
    if (IsIn(path, stage.callers)) continue;
    return absl::StrCat("rule 2: only ", std::string(stage.callers[0]), " may call this stage");
  }
  if (absl::EndsWith(include.target, ".grpc.pb.h")) {
    return IsIn(path, kRpc) ? "" : "rule 4: gRPC has its home in server/grpc/ and client/src/";
  }
  if (const ThirdParty* party = FindThirdParty(target); party != nullptr) {
    if (IsIn(path, party->homes)) return "";
    std::string homes;
    for (const std::string_view home : party->homes)
      absl::StrAppend(&homes, " ", std::string(home));
    return absl::StrCat("rule 4: its home is", homes);
  }
  const bool is_known =
      IsIn(target, kOurs) || (!include.is_quoted && (IsCpp(target) || kSystem.contains(target)));
  return is_known ? "" : "rule 4: a third party without a home; give it one in kThirdParties";
}

// Folders of core that each of `programs` reaches, directly or through other files.
std::set<std::string> ReachedCoreFolders(const std::vector<SourceFile>& files,
                                         std::string_view program) {
  std::map<std::string, const SourceFile*> by_path;
  std::vector<const SourceFile*> open;
  for (const SourceFile& file : files) {
    by_path[file.path] = &file;
    if (StartsWith(file.path, program)) open.push_back(&file);
  }
  std::set<std::string> folders;
  std::set<std::string> seen;
  while (!open.empty()) {
    const SourceFile& file = *open.back();
    open.pop_back();
    for (const Include& include : FindIncludes(file)) {
      if (!StartsWith(include.target, "core/") || !seen.insert(include.target).second) continue;
      folders.insert(include.target.substr(0, include.target.rfind('/') + 1));
      const auto found = by_path.find(include.target);
      if (found == by_path.end()) continue;
      open.push_back(found->second);
      // What the header's own source includes is linked in with it.
      std::string source = found->second->path;
      source.replace(source.size() - 1, 1, "cc");
      if (by_path.contains(source)) open.push_back(by_path[source]);
    }
  }
  return folders;
}

std::vector<std::string> Violations(const std::vector<SourceFile>& files) {
  std::vector<std::string> violations;
  std::map<std::string, std::string> core_folders;  // and their first file
  for (const SourceFile& file : files) {
    for (const Include& include : FindIncludes(file)) {
      const std::string fault = Fault(include);
      if (fault.empty()) continue;
      violations.push_back(
          absl::StrCat(file.path, ":", include.line, ": includes ", include.target, "; ", fault));
    }
    if (!StartsWith(file.path, "core/") || IsIn(file.path, kCoreByDesign)) continue;
    core_folders.try_emplace(file.path.substr(0, file.path.rfind('/') + 1), file.path);
  }
  std::map<std::string, std::vector<std::string>> users;  // programs, by folder of core
  for (const char* const program : {"server/", "worker/", "client/"}) {
    for (const std::string& folder : ReachedCoreFolders(files, program)) {
      users[folder].push_back(program);
    }
  }
  for (const auto& [folder, file] : core_folders) {
    if (users[folder].size() > 1) continue;
    violations.push_back(
        absl::StrCat(file, ":1: rule 3: ", folder,
                     " is in core, but needed by no two of server, worker, client"));
  }
  return violations;
}

// Rule 6: folders that hold too many sources and headers.
std::vector<std::string> CrowdedFolders(const std::vector<SourceFile>& files) {
  std::map<std::string, size_t> num_files;
  for (const SourceFile& file : files) ++num_files[file.path.substr(0, file.path.rfind('/') + 1)];
  std::vector<std::string> crowded;
  for (const auto& [folder, count] : num_files) {
    if (count <= kMaxFilesPerFolder) continue;
    crowded.push_back(absl::StrCat(folder, ": rule 6: ", count, " sources and headers, more than ",
                                   kMaxFilesPerFolder));
  }
  return crowded;
}

std::vector<SourceFile> LoadSources(const std::filesystem::path& root) {
  std::vector<SourceFile> files;
  for (const char* const top : {"core", "worker", "server", "client", "tests"}) {
    for (const auto& entry : std::filesystem::recursive_directory_iterator(root / top)) {
      const std::string extension = entry.path().extension().string();
      if (extension != ".h" && extension != ".cc" && extension != ".c") continue;
      std::ifstream stream(entry.path(), std::ios::binary);
      files.push_back({std::filesystem::relative(entry.path(), root).generic_string(),
                       {std::istreambuf_iterator<char>(stream), {}}});
    }
  }
  std::sort(files.begin(), files.end(),
            [](const SourceFile& a, const SourceFile& b) { return a.path < b.path; });
  return files;
}

TEST(Layering, HoldsInAllSources) {
  const std::vector<SourceFile> files = LoadSources(LIQUIDBLEND_SOURCE_DIR);
  EXPECT_GT(files.size(), 100u);
  EXPECT_THAT(Violations(files), IsEmpty());
  EXPECT_THAT(CrowdedFolders(files), IsEmpty());
}

TEST(Layering, IsNotBrokenByGoodFiles) {
  EXPECT_THAT(
      Violations(
          {{"core/mesh/animation.h", "#include <Eigen/Core>\n#include <vector>\n"},
           {"client/cli/a.cc", "#include \"core/mesh/registration_options.h\"\n"},
           {"server/main.cc", "#include \"core/mesh/animation.h\"\n#include <CLI/CLI.hpp>\n"},
           {"server/admin/main.cc", "#include \"server/store_flags.h\"\n"},
           {"server/collector.cc", "#include \"server/admin/collect.h\"\n"},
           {"worker/jobs/run.cc", "#include \"worker/ingest/read_animation.h\"\n"},
           {"worker/ingest/read_animation.cc",
            "#include <zlib.h>\n#include \"core/mesh/animation.h\"\n"},
           {"client/cli/main.cc", "#include \"core/base/version.h\"\n"},
           {"client/examples/a/a.c",
            "#include \"a.h\"\n#include <epoxy/gl.h>\n#include <stdio.h>\n"
            "#include <liquidblend/liquidblend.h>\n"},
           {"client/src/a.cc",
            "#include \"liquidblend/v1/liquidblend.grpc.pb.h\"\n"
            "#include \"liquidblend/client.h\"\n#include <sys/mman.h>\n"},
           {"tests/a_test.cc", "#include <zlib.h>\n#include \"core/slice/slice.h\"\n"}}),
      IsEmpty());
}

TEST(Layering, NamesFileLineAndRuleOfEachOffender) {
  EXPECT_THAT(
      Violations({
          {"client/cli/a.cc", "#include \"core/mesh/animation.h\"\n"},
          {"client/examples/a/a.c",
           "#include <liquidblend/client.h>\n#include \"client/c/a.h\"\n#include <zlib.h>\n"},
          {"client/include/liquidblend/a.h", "#include <Eigen/Core>\n"},
          {"client/src/b.cc",
           "\n\n# include \"server/grpc/call.h\"\n#include \"core/base/version.h\"\n"},
          {"server/a.cc", "// text\n#include \"worker/jobs/run.h\"\n"},
          {"server/base/a.cc", "#include \"core/slice/slice.h\"\n"},
          {"server/catalog/a.cc", "#include <tbb/parallel_for.h>\n"},
          {"server/grpc/a.cc", "#include <tests/synthetic/shapes.h>\n"},
          {"server/tar/a.cc", "#include <Eigen/SparseCholesky>\n"},
          {"worker/ingest/a.cc", "#include <foo/bar.h>\n#include \"near.h\"\n"},
          {"worker/jobs/a.cc", "#include \"liquidblend/v1/liquidblend.grpc.pb.h\"\n"},
      }),
      ElementsAre(
          "client/cli/a.cc:1: includes core/mesh/animation.h; rule 1: client/ may not depend on it",
          "client/examples/a/a.c:1: includes liquidblend/client.h; rule 1: an example includes "
          "liquidblend/liquidblend.h alone",
          "client/examples/a/a.c:2: includes client/c/a.h; rule 1: an example includes "
          "liquidblend/liquidblend.h alone",
          "client/examples/a/a.c:3: includes zlib.h; rule 4: its home is worker/ingest/ "
          "server/http/ client/cli/",
          "client/include/liquidblend/a.h:1: includes Eigen/Core; rule 4: client/include/ holds "
          "neither generated code nor Eigen",
          "client/src/b.cc:3: includes server/grpc/call.h; rule 1: client/ may not depend on it",
          "client/src/b.cc:4: includes core/base/version.h; rule 1: client/ may not depend on it",
          "server/a.cc:2: includes worker/jobs/run.h; rule 1: server/ may not depend on it",
          "server/base/a.cc:1: includes core/slice/slice.h; rule 2: only core/frames/ may call "
          "this "
          "stage",
          "server/catalog/a.cc:1: includes tbb/parallel_for.h; rule 4: its home is core/parallel/",
          "server/grpc/a.cc:1: includes tests/synthetic/shapes.h; rule 1: server/ may not depend "
          "on "
          "it",
          "server/tar/a.cc:1: includes Eigen/SparseCholesky; rule 4: its home is "
          "worker/registration/",
          "worker/ingest/a.cc:1: includes foo/bar.h; rule 4: a third party without a home; give it "
          "one in kThirdParties",
          "worker/ingest/a.cc:2: includes near.h; rule 4: a third party without a home; give it "
          "one in kThirdParties",
          "worker/jobs/a.cc:1: includes liquidblend/v1/liquidblend.grpc.pb.h; rule 4: gRPC has its "
          "home in server/grpc/ and client/src/"));
}

TEST(Layering, KeepsOutOfCoreWhatOneProgramNeeds) {
  EXPECT_THAT(
      Violations({{"core/base/a.h", ""},
                  {"core/mesh/b.h", "#include \"core/base/a.h\"\n"},
                  {"core/odd/c.h", ""},
                  {"server/d.cc", "#include \"core/mesh/b.h\"\n"},
                  {"worker/e.cc", "#include \"core/mesh/b.h\"\n#include \"core/odd/c.h\"\n"}}),
      ElementsAre("core/odd/c.h:1: rule 3: core/odd/ is in core, but needed by no two of server, "
                  "worker, client"));
}

TEST(Layering, LeadsFromHigherRoomsToLowerOnes) {
  EXPECT_THAT(
      Violations(
          {{"worker/registration/fit/a.h",
            "#include \"worker/registration/fit/b.h\"\n"
            "#include \"worker/registration/surface/c.h\"\n"},
           {"worker/registration/register.cc", "#include \"worker/registration/finish/d.h\"\n"},
           {"worker/registration/surface/c.h", "#include \"worker/registration/fit/a.h\"\n"},
           {"worker/spacetime/tracked/e.h", "#include \"worker/spacetime/build.h\"\n"}}),
      ElementsAre("worker/registration/surface/c.h:1: includes worker/registration/fit/a.h; "
                  "rule 5: it is in a higher room",
                  "worker/spacetime/tracked/e.h:1: includes worker/spacetime/build.h; rule 5: it "
                  "is in a higher room"));
}

TEST(Layering, OrdersTheRoomsOfEachTopFolder) {
  const std::pair<const char*, const char*> upward[] = {
      {"client/include/liquidblend/a.h", "client/src/a.h"},
      {"client/src/a.cc", "client/cli/print/a.h"},
      {"core/base/a.h", "core/parallel/a.h"},
      {"core/mesh/a.h", "core/store/files/a.h"},
      {"core/parallel/a.h", "core/mesh/a.h"},
      {"server/admin/check.cc", "server/base/a.h"},
      {"worker/ingest/clean/a.cc", "worker/jobs/a.h"}};
  for (const auto& [path, target] : upward) {
    const SourceFile file = {path, ""};
    EXPECT_EQ(Fault({&file, 1, target, true}), "rule 5: it is in a higher room") << path;
    EXPECT_FALSE(LeadsUpwards(target, path)) << path;
  }
}

TEST(Layering, CountsTheFilesOfAFolder) {
  std::vector<SourceFile> files;
  for (int k = 0; k < 40; ++k) files.push_back({absl::StrCat("core/mesh/", k, ".h"), ""});
  files.push_back({"core/mesh/more/a.h", ""});
  EXPECT_THAT(CrowdedFolders(files), IsEmpty());
  files.push_back({"core/mesh/a.cc", ""});
  EXPECT_THAT(CrowdedFolders(files),
              ElementsAre("core/mesh/: rule 6: 41 sources and headers, more than 40"));
}

}  // namespace
}  // namespace liquidblend
