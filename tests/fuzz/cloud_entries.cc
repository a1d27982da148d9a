// What S3 and the services that give out credentials answer, and files of credentials.
#include <algorithm>
#include <string>

#include "absl/status/status.h"
#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "core/store/blobs/aws_credentials.h"
#include "core/store/blobs/s3_client.h"
#include "core/store/blobs/s3_transport.h"
#include "tests/fuzz/entries.h"
#include "tests/fuzz/input.h"
#include "tests/fuzz/require.h"

namespace liquidblend::fuzz {
namespace {

using store::S3Verdict;

constexpr const char* kMethods[] = {"GET", "HEAD", "PUT", "POST", "DELETE"};
constexpr const char* kClosingTags[] = {"", "</ListBucketResult>",
                                        "</CompleteMultipartUploadResult>", "</UploadId>",
                                        "</ListMultipartUploadsResult>"};
constexpr size_t kLongestMessage = 1000;

bool IsPrintable(absl::string_view text) {
  return std::all_of(text.begin(), text.end(),
                     [](char c) { return absl::ascii_isprint(static_cast<unsigned char>(c)); });
}

bool HasControlCharacter(const std::string& text) {
  return std::any_of(text.begin(), text.end(),
                     [](char c) { return absl::ascii_iscntrl(static_cast<unsigned char>(c)); });
}

void RequireMatch(S3Verdict verdict, const absl::Status& error, int status) {
  Require(!error.ok() && IsPrintable(error.message()), "errors are printable");
  Require(error.message().size() < kLongestMessage, "errors are short");
  Require(absl::StrContains(error.message(), "s3://bucket/key"), "errors name the object");
  Require(absl::IsUnavailable(error) == (verdict == S3Verdict::kTransient),
          "what is transient is unavailable");
  Require(absl::IsPermissionDenied(error) == (verdict == S3Verdict::kRefused),
          "what is refused is denied");
  Require(!absl::IsNotFound(error) || status == 404, "nothing is lost unless S3 says so");
}

void RequireValidPage(const std::string& document) {
  const absl::StatusOr<store::S3Page> page = store::ParseS3Page(document, "prefix/");
  Require(page.ok() || !page.status().message().empty(), "a refusal says why");
  if (!page.ok()) return;
  Require(page->objects.size() <= document.size() / std::string("<Contents>").size(),
          "each object is there");
  for (const store::S3Object& object : page->objects) {
    Require(object.size_bytes >= 0, "sizes are not negative");
  }
}

void RequireValidUploadPage(const std::string& document) {
  const absl::StatusOr<store::S3UploadPage> page = store::ParseS3UploadPage(document, "prefix/");
  Require(page.ok() || !page.status().message().empty(), "a refusal says why");
  if (!page.ok()) return;
  for (const store::S3OpenUpload& upload : page->uploads) {
    Require(!upload.id.empty(), "uploads have ids");
  }
}

}  // namespace

// uint8 method, uint8 which closing tag must be there, uint16 status; the body.
void RunS3Answer(std::span<const std::byte> bytes) {
  Input input(bytes);
  store::S3Call call;
  call.path = "/bucket/key";
  call.method = kMethods[input.Byte() % std::size(kMethods)];
  call.closing_tag = kClosingTags[input.Byte() % std::size(kClosingTags)];
  store::HttpAnswer answer;
  answer.status = input.Word();
  answer.body = std::string(input.Rest());
  RequireValidPage(answer.body);
  RequireValidUploadPage(answer.body);
  const S3Verdict verdict = store::JudgeS3Answer(call, answer);
  if (verdict == S3Verdict::kDone) {
    Require(answer.status < 300, "an error is not a success");
    Require(absl::StrContains(answer.body, call.closing_tag), "answers are complete");
    return;
  }
  RequireMatch(verdict, store::S3ErrorOf(call, answer, verdict), answer.status);
}

// uint8: an endpoint's document, or a file and which of its sections; the text.
void RunCredentials(std::span<const std::byte> bytes) {
  Input input(bytes);
  const uint8_t kind = input.Byte();
  const std::string text(input.Rest());
  if (kind % 2 == 0) {
    const auto found = store::ParseEndpointCredentials(text);
    if (!found.has_value()) return;
    Require(!found->credentials.access_key_id.empty(), "there is a key id");
    Require(!found->credentials.secret_access_key.empty(), "there is a key");
    Require(
        !HasControlCharacter(found->credentials.access_key_id + found->credentials.session_token),
        "headers stay one line");
    return;
  }
  const auto found = store::ParseCredentialsFile(text, kind % 4 == 1 ? "default" : "other");
  if (!found.has_value()) return;
  for (const std::string& value :
       {found->access_key_id, found->secret_access_key, found->session_token}) {
    Require(!absl::StrContains(value, '\n'), "values are one line");
    Require(absl::StripAsciiWhitespace(value) == value, "values have no space around them");
  }
}

}  // namespace liquidblend::fuzz
