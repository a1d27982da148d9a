// Credentials from HTTP services of a container's or an instance's host.
#include <algorithm>
#include <array>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/store/blobs/aws_credentials.h"

namespace liquidblend::store {
namespace {

using Headers = std::vector<std::pair<std::string, std::string>>;

constexpr char kContainerHost[] = "http://169.254.170.2";
constexpr char kInstanceHost[] = "http://169.254.169.254";
constexpr char kRoles[] = "/latest/meta-data/iam/security-credentials/";
constexpr int64_t kMaxAnswerBytes = int64_t{1} << 16;

std::string EnvironmentOr(const char* name, const std::string& fallback = "") {
  const char* const value = std::getenv(name);
  return value == nullptr || *value == '\0' ? fallback : value;
}

// Returns the body of the answer. The error's message has neither body nor headers, since both may
// be secret. Errors: kNotFound for status 404, else kUnavailable.
absl::StatusOr<std::string> Ask(HttpClient& http, const std::string& method, const std::string& url,
                                Headers headers) {
  const HttpRequest request = {.method = method,
                               .url = url,
                               .headers = std::move(headers),
                               .body = {},
                               .max_answer_bytes = kMaxAnswerBytes};
  absl::StatusOr<HttpAnswer> answer = std::move(http.Run({&request, 1}).front());
  if (!answer.ok()) {
    return absl::UnavailableError(
        absl::StrCat("credentials from ", url, ": ", answer.status().message()));
  }
  if (answer->status == 200) return std::move(answer->body);
  const std::string message =
      absl::StrCat("credentials from ", url, ": HTTP status ", answer->status);
  return answer->status == 404 ? absl::NotFoundError(message) : absl::UnavailableError(message);
}

absl::StatusOr<FoundCredentials> Parse(const std::string& json, const std::string& url) {
  std::optional<FoundCredentials> found = ParseEndpointCredentials(json);
  if (found.has_value()) return *std::move(found);
  return absl::UnavailableError(absl::StrCat("credentials from ", url, ": not a valid answer"));
}

// Tokens must not go to other hosts unencrypted.
bool MayBeAsked(const std::string& url) {
  if (absl::StartsWith(url, "https://")) return true;
  constexpr std::array kHosts = {"127.0.0.1",     "localhost",      "[::1]",
                                 "169.254.170.2", "169.254.170.23", "[fd00:ec2::23]"};
  for (const absl::string_view host : kHosts) {
    const std::string start = absl::StrCat("http://", host);
    const char next = url.size() > start.size() ? url[start.size()] : '/';
    if (absl::StartsWith(url, start) && (next == '/' || next == ':')) {
      return !absl::StrContains(url.substr(0, url.find('/', start.size())), "@");
    }
  }
  return false;
}

absl::StatusOr<Headers> ContainerHeaders() {
  std::string token = EnvironmentOr("AWS_CONTAINER_AUTHORIZATION_TOKEN");
  const std::string path = EnvironmentOr("AWS_CONTAINER_AUTHORIZATION_TOKEN_FILE");
  if (!path.empty()) {
    std::ifstream file(path);
    std::stringstream text;
    if (file) text << file.rdbuf();
    token = std::string(absl::StripAsciiWhitespace(text.str()));
    if (token.empty()) {
      return absl::UnavailableError(
          absl::StrCat("AWS_CONTAINER_AUTHORIZATION_TOKEN_FILE ", path, " cannot be read"));
    }
  }
  if (token.empty()) return Headers();
  return Headers{{"Authorization", token}};
}

bool HasControlCharacter(const std::string& text) {
  return std::any_of(text.begin(), text.end(),
                     [](char c) { return absl::ascii_iscntrl(static_cast<unsigned char>(c)); });
}

}  // namespace

std::optional<FoundCredentials> ParseEndpointCredentials(const std::string& json) {
  constexpr bool kNoExceptions = false;
  const nlohmann::json document = nlohmann::json::parse(json, nullptr, kNoExceptions);
  const auto text = [&](const char* name) {
    const auto field = document.find(name);  // the end, unless the document is an object
    return field == document.end() || !field->is_string() ? "" : field->get<std::string>();
  };
  FoundCredentials found;
  found.credentials = {text("AccessKeyId"), text("SecretAccessKey"), text("Token")};
  std::string error;
  const std::string expiration = text("Expiration");
  if (!expiration.empty() &&
      !absl::ParseTime(absl::RFC3339_full, expiration, &found.expires, &error)) {
    return std::nullopt;
  }
  const AwsCredentials& keys = found.credentials;
  if (keys.access_key_id.empty() || keys.secret_access_key.empty()) return std::nullopt;
  for (const std::string& value : {keys.access_key_id, keys.session_token}) {
    if (HasControlCharacter(value)) return std::nullopt;
  }
  return found;
}

absl::StatusOr<std::optional<FoundCredentials>> CredentialsFromContainer(HttpClient& http) {
  const std::string relative = EnvironmentOr("AWS_CONTAINER_CREDENTIALS_RELATIVE_URI");
  const std::string url = relative.empty() ? EnvironmentOr("AWS_CONTAINER_CREDENTIALS_FULL_URI")
                                           : absl::StrCat(kContainerHost, relative);
  if (url.empty()) return std::optional<FoundCredentials>();
  if (!MayBeAsked(url)) {
    return absl::InvalidArgumentError(absl::StrCat("AWS_CONTAINER_CREDENTIALS_FULL_URI ", url,
                                                   " is neither https nor of this host"));
  }
  LB_ASSIGN_OR_RETURN(Headers headers, ContainerHeaders());
  absl::StatusOr<std::string> answer = Ask(http, "GET", url, std::move(headers));
  if (!answer.ok()) return absl::UnavailableError(answer.status().message());
  LB_ASSIGN_OR_RETURN(FoundCredentials found, Parse(*answer, url));
  return std::optional(std::move(found));
}

absl::StatusOr<std::optional<FoundCredentials>> CredentialsFromInstance(HttpClient& http) {
  if (absl::AsciiStrToLower(EnvironmentOr("AWS_EC2_METADATA_DISABLED")) == "true") {
    return std::optional<FoundCredentials>();
  }
  std::string host = EnvironmentOr("AWS_EC2_METADATA_SERVICE_ENDPOINT", kInstanceHost);
  while (absl::EndsWith(host, "/")) host.pop_back();
  const absl::StatusOr<std::string> token =
      Ask(http, "PUT", absl::StrCat(host, "/latest/api/token"),
          {{"X-aws-ec2-metadata-token-ttl-seconds", "300"}});
  if (!token.ok()) return absl::UnavailableError(token.status().message());
  if (HasControlCharacter(*token)) {
    return absl::UnavailableError(
        absl::StrCat("credentials from ", host, ": the token of the session is not one line"));
  }
  const Headers headers = {{"X-aws-ec2-metadata-token", *token}};
  const std::string roles_url = absl::StrCat(host, kRoles);
  const absl::StatusOr<std::string> roles = Ask(http, "GET", roles_url, headers);
  if (absl::IsNotFound(roles.status())) {
    return absl::UnavailableError(absl::StrCat("no credentials for S3: ", roles_url,
                                               " names no role of this instance, and neither the "
                                               "environment nor ~/.aws/credentials has a key"));
  }
  if (!roles.ok()) return roles.status();
  const std::string url = absl::StrCat(roles_url, roles->substr(0, roles->find('\n')));
  const absl::StatusOr<std::string> answer = Ask(http, "GET", url, headers);
  if (!answer.ok()) return absl::UnavailableError(answer.status().message());
  LB_ASSIGN_OR_RETURN(FoundCredentials found, Parse(*answer, url));
  return std::optional(std::move(found));
}

}  // namespace liquidblend::store
