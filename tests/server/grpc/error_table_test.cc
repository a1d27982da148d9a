// docs/errors.md is what a server answers to bad requests. To write it anew after a change:
//   LIQUIDBLEND_WRITE_DOCS=1 build/release/tests/server_grpc_test --gtest_filter=ErrorTable*
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <sstream>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_replace.h"
#include "google/rpc/error_details.pb.h"
#include "tests/server/grpc/raw_call.h"
#include "tests/server/grpc/server_testing.h"

namespace liquidblend::server {
namespace {

constexpr char kIntroduction[] =
    R"(# Errors
What a server answers to bad requests, in the words of protobuf's text format; several messages of a stream are separated by `then`. Written by `tests/server/grpc/error_table_test.cc` from real calls, which fails if this file says something else; to write it anew: `LIQUIDBLEND_WRITE_DOCS=1 build/release/tests/server_grpc_test --gtest_filter=ErrorTable*`.

The server there has the finished animations `a` and `b`, the family `splash` of one target, its refinement under way, and low limits: 4 files and 1000 bytes an upload, 100 bytes a chunk, 3 targets, 2 correspondences, 100,001,000 bytes of memory a worker.

Every error carries a `google.rpc.ErrorInfo` of the domain `liquidblend`: a reason for programs, and in its metadata what the error is about. The fields are those of `google.rpc.BadRequest`, the delay is that of `google.rpc.RetryInfo`. Messages are for people and may change.

)";

struct Case {
  std::string method;
  std::vector<std::string> messages;
  std::string as = {};  // a principal; none: no token
};

const std::vector<Case> kRequests = {
    {"GetFrame", {R"(family: "animations/splash")"}},
    {"GetFrame", {R"(family: "families/none" weights: 0.5)"}},
    {"GetFrame", {R"(family: "families/splash" version: -1)"}},
    {"GetFrame", {R"(family: "families/splash" weights: 0.5 version: 7)"}},
    {"GetFrame", {R"(family: "families/splash" weights: [0.5, 0.5])"}},
    {"GetFrame", {R"(family: "families/splash" weights: 2.5)"}},
    {"GetFrame", {R"(family: "families/splash" weights: nan)"}},
    {"GetFrame", {R"(family: "families/splash" weights: 0.5 time_s: 99)"}},
    {"GetFrame", {R"(family: "families/splash" weights: 0.5 encoding { position_bits: 40 })"}},
    {"GetFrame", {R"(family: "families/splash" weights: 0.5 encoding { position_step_m: 1e-07 })"}},
    {"GetFrame",
     {R"(family: "families/splash" weights: 0.5 encoding { position_bits: 12 position_step_m: 0.001 })"}},
    {"GetFrame",
     {R"(family: "families/splash" weights: 0.5 encoding { format: PLY position_bits: 12 })"}},
    {"GetFrame",
     {R"(family: "families/splash" weights: 0.5 encoding { format: OBJ } surface { attributes: VELOCITIES })"}},
    {"GetFrame", {R"(family: "families/splash" weights: 0.5 surface { smoothing_passes: 99 })"}},
    {"GetFrame", {R"(family: "families/splash" weights: 0.5 surface { level_of_detail: 9 })"}},
    {"GetFrame", {R"(family: "families/splash" parameters { name: "h" value: 1 })"}},
    {"GetFrame", {R"(family: "families/splash" weights: 1 parameters { name: "h" value: 1 })"}},
    {"StreamFrames", {}},
    {"StreamFrames", {R"(weights: 0.5)"}},
    {"StreamFrames", {R"(family: "families/none")"}},
    {"StreamFrames", {R"(family: "families/splash" weights: 0.5 rate: 1e9)"}},
    {"StreamFrames", {R"(family: "families/splash" weights: 0.5 frames_per_second: 0)"}},
    {"StreamFrames", {R"(family: "families/splash" weights: 0.5 lossless: true rate: 0)"}},
    {"StreamFrames", {R"(family: "families/splash" weights: 0.5 time_s: -1)"}},
    {"StreamFrames", {R"(family: "families/splash" weights: 0.5 credit: -1)"}},
    {"MeasureCorrespondences", {R"(family: "families/none")"}},
    {"MeasureCorrespondences", {R"(family: "families/splash" target_index: 1)"}},
    {"MeasureCorrespondences",
     {R"(family: "families/splash" correspondences { source { time_s: 99 } })"}},
    {"GetFamily", {R"(name: "families/none")"}},
    {"GetFamily", {R"(name: "families/NO")"}},
    {"ListFamilies", {R"(page_size: -1)"}},
    {"ListFamilies", {R"(page_token: "not from here")"}},
    {"RollbackFamily", {R"(name: "families/none" version: 1)"}},
    {"RollbackFamily", {R"(name: "families/splash" version: 0)"}},
    {"RollbackFamily", {R"(name: "families/splash" version: 1)"}},
    {"DeleteFamily", {R"(name: "families/none")"}},
    {"DeleteFamily", {R"(name: "families/splash")"}},
    {"GetAnimation", {R"(name: "animations/none")"}},
    {"GetAnimation", {R"(name: "animations/../a")"}},
    {"GetAnimationFrame", {R"(animation: "animations/none")"}},
    {"GetAnimationFrame", {R"(animation: "animations/busys")"}},
    {"GetAnimationFrame", {R"(animation: "animations/a" frame_number: 99)"}},
    {"GetAnimationFrame", {R"(animation: "animations/a" time_s: 99)"}},
    {"GetAnimationFrame", {R"(animation: "animations/a" level_of_detail: 9)"}},
    {"ListAnimations", {R"(page_size: -1)"}},
    {"DeleteAnimation", {R"(name: "animations/a")"}},
    {"RegisterFamily", {R"(family_id: "No!")"}},
    {"RegisterFamily", {R"(family_id: "new" source: "animations/a")"}},
    {"RegisterFamily", {R"(family_id: "new" source: "families/a" targets: "animations/b")"}},
    {"RegisterFamily", {R"(family_id: "new" source: "a" targets: "animations/a")"}},
    {"RegisterFamily", {R"(family_id: "new" source: "animations/a" targets: "animations/a")"}},
    {"RegisterFamily", {R"(family_id: "new" source: "animations/a" targets: "animations/none")"}},
    {"RegisterFamily", {R"(family_id: "splash" source: "animations/a" targets: "animations/b")"}},
    {"RegisterFamily", {R"(family_id: "none" refine: true)"}},
    {"RegisterFamily",
     {R"(family_id: "new" source: "animations/a" targets: ["animations/b", "animations/c", "animations/d", "animations/e"])"}},
    {"RegisterFamily",
     {R"(family_id: "new" source: "animations/a" targets: "animations/b" options { max_iterations: -1 sample_share: 2 })"}},
    {"RegisterFamily",
     {R"(family_id: "new" source: "animations/a" targets: "animations/b" space_time { spacing_edges: 100 })"}},
    {"RegisterFamily",
     {R"(family_id: "new" source: "animations/a" targets: "animations/b" correspondences { correspondences { hard: true } })"}},
    {"RegisterFamily",
     {R"(family_id: "new" source: "animations/a" targets: "animations/b" parameter_space { names: "h" points { values: 1 } })"}},
    {"RegisterFamily",
     {R"(family_id: "new" source: "animations/a" targets: "animations/b" parameter_space { names: "h" points { values: 1 } points { values: 2 } interpolation: SMOOTH })"}},
    {"RegisterFamily",
     {R"(family_id: "new" source: "animations/a" targets: "animations/b" time_blending { kind: SQUARES rest_time_s: 1 })"}},
    {"RegisterFamily",
     {R"(family_id: "new" source: "animations/a" targets: "animations/b" priority: 101)"}},
    {"UploadAnimation", {}},
    {"UploadAnimation", {R"(chunk: "abc")"}},
    {"UploadAnimation", {R"(header { animation_id: "No!" })"}},
    {"UploadAnimation", {R"(header { animation_id: "a" })"}},
    {"UploadAnimation", {R"(header { animation_id: "new" options { vertex_scale: -1 } })"}},
    {"UploadAnimation", {R"(header { animation_id: "new" options { frames_per_second: 1e10 } })"}},
    {"UploadAnimation", {R"(header { animation_id: "new" })"}},
    {"UploadAnimation", {R"(header { animation_id: "new" })", R"(header { animation_id: "new" })"}},
    {"UploadAnimation", {R"(header { animation_id: "new" })", R"(file { name: "../f1.ply" })"}},
    {"UploadAnimation",
     {R"(header { animation_id: "new" })", R"(file { name: "f1.ply" size_bytes: 1001 })"}},
    {"UploadAnimation",
     {R"(header { animation_id: "new" })", R"(file { name: "f1.ply" size_bytes: 3 })"}},
    {"UploadAnimation",
     {R"(header { animation_id: "new" })", R"(file { name: "f1.ply" size_bytes: 1 })",
      R"(chunk: "abc")"}},
    {"UploadAnimation",
     {R"(header { animation_id: "new" })", R"(file { name: "f1.bobj.gz" size_bytes: 50 })",
      R"(chunk: "01234567890123456789012345678901234567890123456789")"}},
    {"UploadAnimation",
     {R"(header { animation_id: "new" })",
      R"(file { name: "f1.ply" size_bytes: 3 blob: "not of PresignUpload" })"}},
    {"PresignUpload", {R"(animation_id: "a" files { checksum: "sha256-0" })"}},
    {"PresignUpload",
     {R"(files { size_bytes: 3 checksum: "xxh3-00000000000000000000000000000000" })"}},
    {"PresignDownload", {R"(name: "families/none")"}},
    {"PresignDownload", {R"(name: "families/splash")"}},
    {"ReadFile", {R"(name: "families/none")"}},
    {"ReadFile", {R"(name: "families/splash" offset: -1)"}},
    {"ImportAnimation", {R"(animation_id: "new" location: "sims/../etc")"}},
    {"ImportAnimation", {R"(animation_id: "new" location: "/etc")"}},
    {"ImportAnimation", {R"(animation_id: "new" location: "other/shot")"}},
    {"ImportAnimation", {R"(animation_id: "new" location: "sims/none")"}},
    {"ImportAnimation", {R"(animation_id: "new" location: "sims")"}},
    {"WatchOperation", {R"(name: "operations/none")"}},
    {"GetOperation", {R"(name: "operations/none")"}},
    {"GetOperation", {R"(name: "none")"}},
    {"GetOperation", {R"(name: "families/none")"}},
    {"ListOperations", {R"(filter: "done")"}},
    {"CancelOperation", {R"(name: "operations/none")"}},
    {"DeleteOperation", {R"(name: "operations/none")"}},
    {"WaitOperation", {R"(name: "operations/none")"}},
};

const std::vector<Case> kStrangers = {
    {"GetFrame", {R"(family: "families/splash")"}},
    {"GetFrame", {R"(family: "families/splash")"}, "an unknown token"},
    {"StreamFrames", {}},
    {"UploadAnimation", {R"(header { animation_id: "new" })"}, "viewer"},
    {"ImportAnimation", {R"(animation_id: "new" location: "sims/shot")"}, "viewer"},
    {"PresignUpload", {""}, "viewer"},
    {"PresignDownload", {""}, "uploader"},
    {"ReadFile", {""}, "uploader"},
    {"RegisterFamily", {R"(family_id: "new")"}, "viewer"},
    {"CancelOperation", {R"(name: "operations/none")"}, "viewer"},
    {"GetFrame", {R"(family: "families/splash")"}, "uploader"},
    {"ListFamilies", {""}, "slow"},
    {"UploadAnimation", {R"(header { animation_id: "new" })"}, "busy"},
    {"ImportAnimation", {R"(animation_id: "new" location: "sims/shot")"}, "busy"},
    {"RegisterFamily",
     {R"(family_id: "new" source: "animations/a" targets: "animations/b")"},
     "busy"},
    {"UploadAnimation",
     {R"(header { animation_id: "new" })", R"(file { name: "f1.ply" size_bytes: 101 })"},
     "small"},
};

class ErrorTableTest : public ServerTest {
 protected:
  void SetUp() override {
    PublishSplash();
    // Whoever published it holds little from now on.
    ASSERT_TRUE(catalog_->LeaseJob("test", absl::Hours(1), /*memory_bytes=*/1).ok());
    store::pb::JobRecord job;
    job.mutable_register_family()->set_family("splash");
    job.mutable_register_family()->set_source("a");
    job.mutable_register_family()->add_targets("b");
    const auto submitted = catalog_->SubmitRegistration(job);
    ASSERT_TRUE(submitted.ok()) << submitted.status();
    job_id_ = submitted->id();
    store::pb::AnimationRecord animation;
    animation.set_id("busys");
    store::pb::JobRecord import;
    import.set_owner("busy");
    import.mutable_import_animation()->set_animation("busys");
    ASSERT_TRUE(catalog_->SubmitImport(animation, import).ok());
  }

  ServerOptions Options() const {
    const std::string root = folder_.path() + "/sims";
    std::filesystem::create_directory(root);
    ServerOptions options;
    options.import_roots = {{"sims", root}};
    options.limits.worker_memory_bytes = 100'001'000;
    return options;
  }

  std::shared_ptr<Authorizer> Principals() {
    const std::string path = folder_.path() + "/tokens.json";
    std::vector<std::string> entries;
    for (const auto& [name, scope] : std::map<std::string, std::string>{{"viewer", "frames"},
                                                                        {"uploader", "write"},
                                                                        {"slow", "frames"},
                                                                        {"busy", "write"},
                                                                        {"small", "write"}}) {
      const std::map<std::string, std::string> limits = {{"slow", R"("requests_per_second": 0.01)"},
                                                         {"busy", R"("max_queued_jobs": 1)"},
                                                         {"small", R"("max_stored_bytes": 100)"}};
      std::vector<std::string> scopes = {scope};
      if (name == "busy") scopes.push_back("register");
      NewToken made = *MakeToken(name, scopes);
      tokens_[name] = made.token;
      const auto limit = limits.find(name);
      if (limit != limits.end()) {
        made.entry.insert(made.entry.size() - 1,
                          absl::StrCat(R"(, "limits": {)", limit->second, "}"));
      }
      entries.push_back(made.entry);
    }
    std::ofstream(path) << R"({"principals": [)" << absl::StrJoin(entries, ",") << "]}";
    return *Authorizer::Open(path);
  }

  grpc::Status Call(const Case& c) {
    for (const MethodDescriptor* method : AllMethods()) {
      if (method->name() != c.method) continue;
      std::vector<std::string> messages;
      for (const std::string& text : c.messages) messages.push_back(FromText(*method, text));
      const auto token = tokens_.find(c.as);
      return CallInBytes(channel_, PathOf(*method), messages,
                         token == tokens_.end() ? c.as : token->second);
    }
    ADD_FAILURE() << "no method " << c.method;
    return grpc::Status::OK;
  }

  std::string RowOf(const Case& c, const grpc::Status& status) {
    EXPECT_FALSE(status.ok()) << c.method << " " << absl::StrJoin(c.messages, " ");
    const auto info = DetailOf<google::rpc::ErrorInfo>(status);
    EXPECT_EQ(info.domain(), "liquidblend") << status.error_message();
    std::vector<std::string> fields;
    const auto bad_request = DetailOf<google::rpc::BadRequest>(status);
    for (const auto& violation : bad_request.field_violations()) {
      fields.push_back(absl::StrCat("`", violation.field(), "`"));
    }
    const std::map<std::string, std::string> metadata(info.metadata().begin(),
                                                      info.metadata().end());
    const auto delay = DetailOf<google::rpc::RetryInfo>(status).retry_delay();
    // Long ones to 50 s, which passing time does not change.
    const int64_t s_left =
        delay.seconds() < 25 ? delay.seconds() : (delay.seconds() + 25) / 50 * 50;
    const std::string retry = s_left > 0 ? absl::StrCat("about ", s_left, " s") : "";
    const std::string request = c.messages.empty()
                                    ? "nothing"
                                    : absl::StrCat("`", absl::StrJoin(c.messages, "` then `"), "`");
    const std::string row = absl::StrCat(
        "| ", c.method, " | ", c.as.empty() ? "" : absl::StrCat("as ", c.as, ": "), request, " | ",
        absl::StatusCodeToString(static_cast<absl::StatusCode>(status.error_code())), " | ",
        info.reason(), " | ", absl::StrJoin(metadata, ", ", absl::PairFormatter("=")), " | ",
        absl::StrJoin(fields, ", "), " | ", retry, " | ",
        absl::StrReplaceAll(status.error_message(), {{"|", "\\|"}}), " |\n");
    return absl::StrReplaceAll(row, {{job_id_, "{id}"}, {"``", "nothing"}});
  }

  std::string Table(const std::vector<Case>& cases) {
    std::string table =
        "| method | request | code | reason | metadata | fields | retry after | message |\n"
        "| --- | --- | --- | --- | --- | --- | --- | --- |\n";
    for (const Case& c : cases) absl::StrAppend(&table, RowOf(c, Call(c)));
    return table;
  }

  std::map<std::string, std::string> tokens_;
  std::string job_id_;
};

TEST_F(ErrorTableTest, IsWhatTheDocumentSays) {
  ServerOptions options = Options();
  Start(options);
  std::string text = absl::StrCat(kIntroduction, "## Requests\n", Table(kRequests));
  const grpc::Status malformed =
      CallInBytes(channel_, "/liquidblend.v1.LiquidBlend/GetFrame", {"\xFF"});
  const grpc::Status broken_stream =
      CallInBytes(channel_, "/liquidblend.v1.LiquidBlend/StreamFrames", {"\xFF"});
  const grpc::Status too_large =
      CallInBytes(channel_, "/liquidblend.v1.LiquidBlend/GetFrame", {std::string(65'537, '\0')});
  const grpc::Status unknown = CallInBytes(channel_, "/liquidblend.v1.LiquidBlend/Fly", {""});
  absl::StrAppend(&text, RowOf({"GetFrame", {"bytes that are no message"}}, malformed),
                  RowOf({"StreamFrames", {"bytes that are no message"}}, broken_stream),
                  RowOf({"GetFrame", {"65,537 bytes"}}, too_large), RowOf({"Fly", {""}}, unknown));
  options.authorizer = Principals();
  Start(options);
  EXPECT_THAT(Call({"ListFamilies", {""}, "slow"}), IsOk());
  absl::StrAppend(
      &text, "\n## Callers\nWith a tokens file, in which `viewer` and `slow` have the ",
      "scope frames, `uploader` has write, `slow` may call once in 100 s, `busy` may have one "
      "operation that is not done and has it, and `small` may store 100 bytes.\n\n",
      Table(kStrangers));

  const std::string path = absl::StrCat(LIQUIDBLEND_SOURCE_DIR, "/docs/errors.md");
  if (getenv("LIQUIDBLEND_WRITE_DOCS") != nullptr) std::ofstream(path) << text;
  std::ifstream file(path);
  std::stringstream committed;
  committed << file.rdbuf();
  EXPECT_EQ(committed.str(), text) << "if the change is meant, see the top of this test";
}

}  // namespace
}  // namespace liquidblend::server
