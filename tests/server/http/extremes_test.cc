// Whatever numbers come in the place of the right ones, by query or WebSocket: see
// tests/server/grpc/extremes_test.cc.
#include "tests/server/extremes.h"

#include <set>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/strip.h"
#include "tests/server/http/port_testing.h"

namespace liquidblend::http {
namespace {

using server::FieldPath;

// Fields of requests that queries do not have: there is one format.
const std::set<std::string> kNotInQueries = {"encoding.format"};

constexpr const char* kExtremeTexts[] = {"0",
                                         "-0",
                                         "1",
                                         "-1",
                                         "4.9e-324",
                                         "-4.9e-324",
                                         "1e-15",
                                         "1e308",
                                         "-1e308",
                                         "1e400",
                                         "nan",
                                         "-nan",
                                         "inf",
                                         "-inf",
                                         "2147483647",
                                         "2147483648",
                                         "-2147483649",
                                         "9223372036854775807",
                                         "9223372036854775808",
                                         "-9223372036854775809",
                                         "1e-400",
                                         "0x7fffffff",
                                         "1e",
                                         "",
                                         ",",
                                         "1,,2"};

// Queries take words for these, and no number.
bool NeedsWord(const FieldPath& path) {
  return path.back()->cpp_type() == server::FieldDescriptor::CPPTYPE_ENUM;
}

// Fields of the query have the names of the message's, without units.
std::string QueryNameOf(const FieldPath& path) {
  if (path[0]->name() == "parameters") return "parameters";
  absl::string_view name = path.back()->name();
  if (!absl::ConsumeSuffix(&name, "_s")) absl::ConsumeSuffix(&name, "_m");
  return std::string(name);
}

class ExtremesTest : public PortTest {
 protected:
  void SetUp() override {
    PortTest::SetUp();
    PublishFamily("waves", "a", "b", 1, {{"h"}, {{0.0}, {1.0}}});
  }

  // The query is understood: what is wrong with it is a value.
  int ExpectGoodAnswer(const std::string& target) {
    const absl::Duration before = server::CpuTime();
    const HttpReply reply = HttpClient(port_->port()).Get(target);
    EXPECT_LT(server::CpuTime() - before, server::kMaxCallCpu) << target;
    EXPECT_GE(reply.code, 200) << target << ": the connection ended";
    EXPECT_LT(reply.code, 500) << target << ": " << reply.body;
    EXPECT_FALSE(absl::StrContains(reply.body, "is not a field of this query")) << target;
    return reply.code;
  }

  // Every extreme for a field of the query. Returns whether one gave a frame.
  bool TryExtremes(const std::string& file, const std::string& name) {
    const bool is_choice = name == "weights" || name == "parameters";
    const std::string begin =
        absl::StrCat("/v1/families/waves/", file, "?", is_choice ? "" : "weights=0.5&", name, "=",
                     name == "parameters" ? "h%3D" : "");
    bool has_frame = false;
    for (const char* text : kExtremeTexts) {
      has_frame |= ExpectGoodAnswer(absl::StrCat(begin, text)) == 200;
    }
    return has_frame;
  }

  bool ServesFrames() {
    return HttpClient(port_->port())
               .Get("/v1/families/waves/frame.drc?weights=0.5&time=0.1")
               .code == 200;
  }
};

TEST_F(ExtremesTest, EveryNumberOfAQueryMayBeAnything) {
  ASSERT_TRUE(ServesFrames());
  server::ResetPeakMemory();
  const int64_t before = server::PeakBytes();
  int num_fields = 0;
  for (const FieldPath& path : server::NumericFieldsOf(*v1::GetFrameRequest::descriptor())) {
    if (kNotInQueries.contains(server::NameOf(path))) continue;
    ++num_fields;
    for (const char* file : {"frame.drc", "frame.ply", "frame.obj", "frame.meshopt"}) {
      EXPECT_TRUE(TryExtremes(file, QueryNameOf(path)) || NeedsWord(path))
          << file << ": no frame with any " << server::NameOf(path);
    }
  }
  EXPECT_GE(num_fields, 10);
  for (const char* text : kExtremeTexts) {
    ExpectGoodAnswer(absl::StrCat("/v1/families?page_size=", text));
  }
  EXPECT_LT(server::PeakBytes() - before, server::kMaxGrowthBytes);
  EXPECT_LT(server::IdleCpuTime(), server::kMaxIdleCpu);
  EXPECT_TRUE(ServesFrames());
}

TEST_F(ExtremesTest, WebSocketsThatStayOpenCostNothing) {
  constexpr int kServersMistake = 4500;
  ASSERT_TRUE(ServesFrames());
  server::ResetPeakMemory();
  const int64_t before = server::PeakBytes();
  std::vector<std::unique_ptr<HttpClient>> open;
  for (const FieldPath& path : server::NumericFieldsOf(*v1::StreamFramesRequest::descriptor())) {
    bool is_reached = false;
    for (size_t k = 0; k < server::NumExtremesOf(path); ++k) {
      v1::StreamFramesRequest request;
      request.set_family("families/waves");
      if (path[0]->name() != "parameters") request.add_weights(0.5);
      if (path[0]->name() == "parameters") request.add_parameters()->set_name("h");
      request.set_rate(0);
      request.set_frames_per_second(0.001);
      const std::string value = server::SetExtreme(request, path, k);
      auto client = std::make_unique<HttpClient>(port_->port());
      ASSERT_EQ(client->Upgrade().code, 101);
      ASSERT_TRUE(client->SendMessage(2, request.SerializeAsString()));
      const bool waits = request.has_credit() && request.credit() == 0;  // for a frame's credit
      if (waits) open.push_back(std::move(client));
      if (waits) continue;
      const WebSocketMessage answer = client->ReadMessage();
      EXPECT_TRUE(answer.opcode == 2 || answer.opcode == 8)
          << server::NameOf(path) << " = " << value;
      EXPECT_LT(answer.close_code(), kServersMistake) << server::NameOf(path) << " = " << value;
      is_reached |=
          answer.opcode == 2 || absl::StrContains(answer.close_reason(), path.back()->name());
      open.push_back(std::move(client));
    }
    EXPECT_TRUE(is_reached) << "nobody looked at " << server::NameOf(path);
  }
  EXPECT_GT(open.size(), 100U);
  EXPECT_LT(server::IdleCpuTime(), server::kMaxIdleCpu);
  EXPECT_LT(server::PeakBytes() - before, server::kMaxGrowthBytes);
  EXPECT_TRUE(ServesFrames());
}

}  // namespace
}  // namespace liquidblend::http
