#include "core/store/blobs/aws_credentials.h"

#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <map>
#include <sstream>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "absl/strings/strip.h"
#include "core/base/log.h"
#include "core/base/status_macros.h"

namespace liquidblend::store {
namespace {

constexpr absl::Duration kRenewBefore = absl::Minutes(5);
constexpr absl::Duration kReadInterval = absl::Seconds(1);
const HttpOptions kEndpointOptions = {.ca_file = {},
                                      .connect_timeout = absl::Seconds(1),
                                      .stall_timeout = absl::Seconds(2),
                                      .is_proxied = false};

std::string EnvironmentVariable(const char* name) {
  const char* const value = std::getenv(name);
  return value == nullptr ? "" : value;
}

bool IsSame(const AwsCredentials& a, const AwsCredentials& b) {
  return a.access_key_id == b.access_key_id && a.secret_access_key == b.secret_access_key &&
         a.session_token == b.session_token;
}

// "name = value" lines of the section, names in lower case; nothing if there is no such section.
std::optional<std::map<std::string, std::string>> ProfileSection(const std::string& text,
                                                                 const std::string& section) {
  std::optional<std::map<std::string, std::string>> values;
  bool is_inside = false;
  for (const absl::string_view raw : absl::StrSplit(text, '\n')) {
    const absl::string_view line = absl::StripAsciiWhitespace(raw);
    if (line.empty() || line[0] == '#' || line[0] == ';') continue;
    if (line[0] == '[') {
      const absl::string_view name = absl::StripSuffix(absl::StripPrefix(line, "["), "]");
      is_inside = absl::StripAsciiWhitespace(name) == section;
      if (is_inside && !values.has_value()) values.emplace();
      continue;
    }
    const std::pair<absl::string_view, absl::string_view> pair =
        absl::StrSplit(line, absl::MaxSplits('=', 1));
    if (!is_inside) continue;
    (*values)[absl::AsciiStrToLower(absl::StripAsciiWhitespace(pair.first))] =
        std::string(absl::StripAsciiWhitespace(pair.second));
  }
  return values;
}

// Error of expired credentials. It is transient: a detached role may come back, and the job is not
// at fault.
absl::Status ExpiredError(const absl::Status& why) {
  return absl::PermissionDeniedError(
      absl::StrCat("credentials for S3 have expired, and there are no new ones: ", why.message()));
}

// Whether the default file may exist soon: its folder exists, so someone manages it.
bool IsDefaultFileExpected() {
  const std::string home = EnvironmentVariable("HOME");
  return !home.empty() && access(absl::StrCat(home, "/.aws").c_str(), F_OK) == 0;
}

absl::Status NoCredentialsError() {
  const std::string message =
      "no credentials for S3: neither AWS_ACCESS_KEY_ID and AWS_SECRET_ACCESS_KEY, nor "
      "~/.aws/credentials, nor AWS_CONTAINER_CREDENTIALS_FULL_URI, nor an instance role";
  return IsDefaultFileExpected() ? absl::UnavailableError(message)
                                 : absl::InvalidArgumentError(message);
}

}  // namespace

std::optional<AwsCredentials> ParseCredentialsFile(const std::string& text,
                                                   const std::string& section) {
  std::optional<std::map<std::string, std::string>> values = ProfileSection(text, section);
  if (!values.has_value()) return std::nullopt;
  return AwsCredentials{(*values)["aws_access_key_id"], (*values)["aws_secret_access_key"],
                        (*values)["aws_session_token"]};
}

absl::StatusOr<std::optional<FoundCredentials>> CredentialsFromEnvironment() {
  FoundCredentials found;
  found.credentials = {EnvironmentVariable("AWS_ACCESS_KEY_ID"),
                       EnvironmentVariable("AWS_SECRET_ACCESS_KEY"),
                       EnvironmentVariable("AWS_SESSION_TOKEN")};
  if (found.credentials.access_key_id.empty() || found.credentials.secret_access_key.empty()) {
    return std::optional<FoundCredentials>();
  }
  return std::optional(std::move(found));
}

absl::StatusOr<std::optional<FoundCredentials>> CredentialsFromFile() {
  std::string path = EnvironmentVariable("AWS_SHARED_CREDENTIALS_FILE");
  std::string profile = EnvironmentVariable("AWS_PROFILE");
  const bool is_asked_for = !path.empty() || !profile.empty();
  const std::string home = EnvironmentVariable("HOME");
  if (path.empty() && home.empty()) return std::optional<FoundCredentials>();
  if (path.empty()) path = absl::StrCat(home, "/.aws/credentials");
  if (profile.empty()) profile = "default";
  std::ifstream file(path);
  std::stringstream text;
  if (file) text << file.rdbuf();
  std::optional<AwsCredentials> credentials = ParseCredentialsFile(text.str(), profile);
  if (!credentials.has_value() && !is_asked_for) return std::optional<FoundCredentials>();
  FoundCredentials found;
  if (credentials.has_value()) found.credentials = *std::move(credentials);
  if (!found.credentials.access_key_id.empty() && !found.credentials.secret_access_key.empty()) {
    return std::optional(std::move(found));
  }
  return absl::UnavailableError(
      absl::StrCat("credentials file ", path, " has no key in its section '", profile, "'"));
}

AwsCredentialsProvider::AwsCredentialsProvider(AwsCredentials given,
                                               std::function<absl::Time()> now)
    : given_(std::move(given)), now_(std::move(now)), http_(kEndpointOptions) {}

absl::StatusOr<FoundCredentials> AwsCredentialsProvider::Read() {
  if (!given_.access_key_id.empty()) return FoundCredentials{.credentials = given_};
  for (const auto& look : {+[](HttpClient&) { return CredentialsFromEnvironment(); },
                           +[](HttpClient&) { return CredentialsFromFile(); },
                           +[](HttpClient& http) { return CredentialsFromContainer(http); },
                           +[](HttpClient& http) { return CredentialsFromInstance(http); }}) {
    absl::StatusOr<std::optional<FoundCredentials>> found = look(http_);
    if (!found.ok()) return found.status();
    if (found->has_value()) return **std::move(found);
  }
  return NoCredentialsError();
}

absl::Status AwsCredentialsProvider::Update() {
  absl::StatusOr<FoundCredentials> found = Read();
  read_at_ = now_();  // afterwards: an endpoint may take longer to fail than kReadInterval
  read_error_ = found.status();
  if (found.ok()) current_ = *std::move(found);
  return read_error_;
}

absl::StatusOr<AwsCredentials> AwsCredentialsProvider::Get() {
  const absl::MutexLock lock(&mutex_);
  const absl::Time now = now_();
  const bool is_due = !current_.has_value() || now > current_->expires - kRenewBefore;
  const bool may_wait = current_.has_value() && now < current_->expires &&
                        absl::AbsDuration(now - read_at_) < kReadInterval;
  if (!is_due || may_wait) return current_->credentials;
  // Callers that waited while a source failed share its error instead of asking it again.
  const bool has_just_failed =
      !read_error_.ok() && absl::AbsDuration(now - read_at_) < kReadInterval;
  const absl::Status updated = has_just_failed ? read_error_ : Update();
  if (updated.ok()) return current_->credentials;
  if (!current_.has_value()) return updated;
  if (now >= current_->expires) return ExpiredError(updated);
  base::LogWarning(absl::StrCat("credentials for S3 cannot be renewed yet: ", updated.ToString()));
  return current_->credentials;
}

bool AwsCredentialsProvider::Renew(const AwsCredentials& refused) {
  const absl::MutexLock lock(&mutex_);
  if (current_.has_value() && !IsSame(current_->credentials, refused)) return true;
  if (absl::AbsDuration(now_() - renewed_at_) < kReadInterval) return false;
  const absl::Status updated = Update();
  renewed_at_ = now_();
  if (!updated.ok()) {
    base::LogWarning(absl::StrCat("credentials for S3: ", updated.ToString()));
    return false;
  }
  const bool is_new = !IsSame(current_->credentials, refused);
  if (is_new) base::LogInfo("credentials for S3 were refused, and there are new ones");
  return is_new;
}

}  // namespace liquidblend::store
