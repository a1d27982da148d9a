#include "server/tar/tar_splitter.h"

#include <cstdlib>
#include <fstream>
#include <sstream>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "tests/core/store/store_testing.h"

namespace liquidblend::tar {
namespace {

using store::AsBytes;
using store::Fails;
using store::Succeeds;
using testing::ElementsAre;
using testing::Pair;

const auto kInvalid = absl::StatusCode::kInvalidArgument;

class FileList final : public FileSink {
 public:
  absl::Status BeginFile(const TarEntry& file) override {
    files.emplace_back(file.name, "");
    sizes.push_back(file.size_bytes);
    return absl::OkStatus();
  }
  absl::Status AddBytes(std::span<const std::byte> bytes) override {
    files.back().second += store::AsString(bytes);
    return absl::OkStatus();
  }
  std::vector<std::pair<std::string, std::string>> files;
  std::vector<int64_t> sizes;
};

absl::Status Split(const std::string& archive, size_t piece, FileList& files) {
  TarSplitter splitter;
  for (size_t begin = 0; begin < archive.size(); begin += piece) {
    const std::string part = archive.substr(begin, piece);
    const absl::Status added = splitter.Add(AsBytes(part), files);
    if (!added.ok()) return added;
  }
  return splitter.End();
}
absl::Status Split(const std::string& archive) {
  FileList files;
  return Split(archive, archive.size() + 1, files);
}

std::string ArchiveOf(const std::vector<std::pair<std::string, std::string>>& files) {
  std::ostringstream out;
  TarWriter writer(out);
  for (const auto& [name, content] : files) {
    EXPECT_THAT(writer.Add(name, AsBytes(content)), Succeeds());
  }
  EXPECT_THAT(writer.End(), Succeeds());
  return out.str();
}

// A header of ustar.
std::string Block(const std::string& name, const std::string& size, char type) {
  std::string block(512, '\0');
  block.replace(0, name.size(), name);
  block.replace(100, 7, "0000644");
  block.replace(124, size.size(), size);
  block[156] = type;
  block.replace(257, 5, "ustar");
  block.replace(263, 2, "00");
  block.replace(148, 8, 8, ' ');
  int sum = 0;
  for (const char c : block) sum += static_cast<unsigned char>(c);
  block.replace(148, 8, absl::StrFormat("%06o%c ", sum, 0));
  return block;
}

const std::string kEnd(1024, '\0');

TEST(TarSplitter, GivesFilesInPiecesOfAnySize) {
  const std::string long_name = std::string(200, 'n') + ".ply";  // with a pax header
  const std::string archive = ArchiveOf({{"shot/f1.ply", "one"},
                                         {"f2.ply", std::string(1000, 'x')},
                                         {"empty.ply", ""},
                                         {long_name, "last"}});
  for (const size_t piece : {size_t{1}, size_t{511}, size_t{512}, size_t{100'000}}) {
    FileList files;
    EXPECT_THAT(Split(archive, piece, files), Succeeds());
    EXPECT_THAT(files.files,
                ElementsAre(Pair("f1.ply", "one"), Pair("f2.ply", std::string(1000, 'x')),
                            Pair("empty.ply", ""), Pair(long_name, "last")));
    EXPECT_THAT(files.sizes, ElementsAre(3, 1000, 0, 4));
  }
}

// As GNU tar and bsdtar write them.
TEST(TarSplitter, ReadsWhatTarWrites) {
  const store::TemporaryFolder folder;
  const std::string name = std::string(150, 'n') + ".ply";
  for (const char* format : {"gnu", "ustar", "pax", "oldgnu", "v7"}) {
    const bool is_short = format == std::string("ustar") || format == std::string("v7");
    const std::string file = is_short ? "f1.ply" : name;
    const std::string in = folder.path() + "/" + format;
    ASSERT_EQ(
        std::system(absl::StrCat("mkdir -p ", in, "/d && printf abc > ", in, "/d/", file,
                                 " && tar -C ", in, " --format=", format, " -cf ", in, ".tar d")
                        .c_str()),
        0);
    std::ifstream stream(in + ".tar", std::ios::binary);
    const std::string archive{std::istreambuf_iterator<char>(stream), {}};
    FileList files;
    EXPECT_THAT(Split(archive, 700, files), Succeeds()) << format;
    EXPECT_THAT(files.files, ElementsAre(Pair(file, "abc"))) << format;
  }
}

TEST(TarSplitter, RefusesWhatIsNoWholeArchive) {
  const std::string archive = ArchiveOf({{"f1.ply", "one"}});
  for (const size_t size : {size_t{0}, size_t{1}, size_t{512}, size_t{514}, size_t{1024}}) {
    EXPECT_THAT(Split(archive.substr(0, size)), Fails(kInvalid, "ends early")) << size;
  }
  EXPECT_THAT(Split(archive.substr(0, 1024) + kEnd), Succeeds());
  EXPECT_THAT(Split(std::string(4096, 'x')), Fails(kInvalid, "not a tar archive"));
  std::string damaged = archive;
  damaged[3] ^= 1;
  EXPECT_THAT(Split(damaged), Fails(kInvalid, "not a tar archive"));
}

TEST(TarSplitter, EndsSoonAfterTheArchive) {
  const std::string archive = ArchiveOf({{"f1.ply", "one"}});
  FileList files;
  EXPECT_THAT(Split(archive + std::string(1 << 20, '\0'), 65536, files), Succeeds());
  EXPECT_THAT(Split(archive + std::string(5 << 20, '\0'), 65536, files),
              Fails(kInvalid, "goes on after its end"));
}

TEST(TarSplitter, RefusesAllButRegularFiles) {
  for (const char type : {'1', '2', '3', '4', '6', 'S', 'M', 'D', 'V'}) {
    EXPECT_THAT(Split(Block("f1.ply", "00000000000", type) + kEnd), Fails(kInvalid, "tar archive"))
        << type;
  }
  const std::string sparse = "22 GNU.sparse.major=1\n22 GNU.sparse.minor=0\n";
  EXPECT_THAT(Split(Block("h", absl::StrFormat("%011o", sparse.size()), 'x') + sparse +
                    std::string(512 - sparse.size(), '\0') + Block("f", "00000001000", '0') +
                    std::string(512, 'x') + kEnd),
              Fails(kInvalid, "tar archive"));
}

TEST(TarSplitter, HeadersAreBounded) {
  EXPECT_THAT(Split(Block("h", "00000200000", 'x')), Fails(kInvalid, "too long"));
  EXPECT_THAT(Split(Block("h", "77777777777", 'L')), Fails(kInvalid, "too long"));
  EXPECT_THAT(Split(Block("h", "\x80\xff\xff\xff", 'x')), Fails(kInvalid, "too long"));
  std::string many;
  for (int k = 0; k < 1000; ++k) absl::StrAppend(&many, Block("h", "00000000000", 'g'));
  EXPECT_THAT(Split(many), Fails(kInvalid, "too long"));
  const std::string folders = Block("d", "00000000000", '5');
  std::string deep;
  for (int k = 0; k <= TarSplitter::kMaxLeftOut; ++k) deep += folders;
  EXPECT_THAT(Split(deep), Fails(kInvalid, "too many directories"));
}

TEST(TarSplitter, SizesMayBeLarge) {
  FileList files;
  TarSplitter splitter;
  const std::string header = Block("f1.ply", std::string("\x80\0\0\0\0\0\0\x01\0\0\0\0", 12), '0');
  EXPECT_THAT(splitter.Add(AsBytes(header), files), Succeeds());
  EXPECT_THAT(files.sizes, ElementsAre(int64_t{1} << 32));
  EXPECT_THAT(splitter.End(), Fails(kInvalid, "ends early"));
}

}  // namespace
}  // namespace liquidblend::tar
