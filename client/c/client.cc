// Connections, and what is asked of servers in one call.
#include <functional>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "client/c/error.h"
#include "client/c/handles.h"
#include "client/c/structs.h"
#include "client/player/server_source.h"
#include "client/src/status_macros.h"

namespace liquidblend::c_api {
namespace {

// The text in JSON, with its quotation marks. A server may have said it: protobuf has checked that
// it is UTF-8, and nobody that it is a name.
std::string JsonOf(const std::string& text) {
  std::string json = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') {
      absl::StrAppend(&json, "\\", std::string(1, c));
    } else if (static_cast<unsigned char>(c) < 0x20) {
      absl::StrAppendFormat(&json, "\\u%04x", static_cast<int>(c));
    } else {
      json += c;
    }
  }
  return json + "\"";
}

// The names of resources as a JSON array.
template <typename Resource>
absl::StatusOr<std::string> NamesOf(const absl::StatusOr<std::vector<Resource>>& resources) {
  if (!resources.ok()) return resources.status();
  std::vector<std::string> names;
  for (const Resource& resource : *resources) {
    names.push_back(JsonOf(resource.name));
  }
  return absl::StrCat("[", absl::StrJoin(names, ","), "]");
}

// Gives the text that `ask(client)` returns.
template <typename Ask>
lb_status GiveText(lb_client* client, lb_text** out, const Ask& ask) {
  return Give(out, [&]() -> absl::StatusOr<std::unique_ptr<lb_text>> {
    LBC_RETURN_IF_ERROR(CheckIsThere(client, "client"));
    LBC_ASSIGN_OR_RETURN(std::string text, ask(*client->client));
    return std::unique_ptr<lb_text>(new lb_text{std::move(text)});
  });
}

}  // namespace
}  // namespace liquidblend::c_api

namespace c_api = liquidblend::c_api;
using liquidblend::Client;

extern "C" {

int32_t lb_version(void) { return LIQUIDBLEND_C_VERSION; }

lb_status lb_client_connect(const lb_connect_options* options, lb_client** out) {
  return c_api::Give(out, [&]() -> absl::StatusOr<std::unique_ptr<lb_client>> {
    lb_connect_options given;
    LBC_RETURN_IF_ERROR(c_api::ReadOrDefault(options, "options", given));
    LBC_ASSIGN_OR_RETURN(const auto allocator, c_api::AllocatorOf(given.allocator));
    LBC_ASSIGN_OR_RETURN(const auto connect, c_api::ConnectOptionsOf(given));
    LBC_ASSIGN_OR_RETURN(std::unique_ptr<Client> client, Client::Connect(connect));
    return std::make_unique<lb_client>(std::move(client), allocator);
  });
}

void lb_client_free(lb_client* client) { delete client; }

lb_status lb_client_get_family(lb_client* client, const char* name, int64_t version,
                               lb_family** out) {
  return c_api::Give(out, [&]() -> absl::StatusOr<std::unique_ptr<lb_family>> {
    LBC_RETURN_IF_ERROR(c_api::CheckIsThere(client, "client"));
    LBC_ASSIGN_OR_RETURN(liquidblend::Family family,
                         client->client->GetFamily(c_api::TextOf(name), version));
    return c_api::MakeFamily(liquidblend::player::FactsOf(family), family.source, family.json);
  });
}

lb_status lb_client_rollback_family(lb_client* client, const char* name, int64_t version,
                                    lb_family** out) {
  return c_api::Give(out, [&]() -> absl::StatusOr<std::unique_ptr<lb_family>> {
    LBC_RETURN_IF_ERROR(c_api::CheckIsThere(client, "client"));
    LBC_ASSIGN_OR_RETURN(liquidblend::Family family,
                         client->client->RollbackFamily(c_api::TextOf(name), version));
    return c_api::MakeFamily(liquidblend::player::FactsOf(family), family.source, family.json);
  });
}

lb_status lb_client_list_families(lb_client* client, lb_text** out) {
  return c_api::GiveText(client, out, [](Client& c) { return c_api::NamesOf(c.ListFamilies()); });
}

lb_status lb_client_list_animations(lb_client* client, lb_text** out) {
  return c_api::GiveText(client, out, [](Client& c) { return c_api::NamesOf(c.ListAnimations()); });
}

lb_status lb_client_list_operations(lb_client* client, lb_text** out) {
  return c_api::GiveText(client, out, [](Client& c) { return c_api::NamesOf(c.ListOperations()); });
}

lb_status lb_client_get_animation(lb_client* client, const char* name, lb_text** out) {
  return c_api::GiveText(client, out, [name](Client& c) -> absl::StatusOr<std::string> {
    LBC_ASSIGN_OR_RETURN(const liquidblend::Animation animation,
                         c.GetAnimation(c_api::TextOf(name)));
    return animation.json;
  });
}

lb_status lb_client_delete_animation(lb_client* client, const char* name) {
  return c_api::Guarded([&]() -> absl::Status {
    LBC_RETURN_IF_ERROR(c_api::CheckIsThere(client, "client"));
    LBC_RETURN_IF_ERROR(c_api::CheckIsThere(name, "name"));
    return client->client->DeleteAnimation(name);
  });
}

lb_status lb_client_delete_family(lb_client* client, const char* name) {
  return c_api::Guarded([&]() -> absl::Status {
    LBC_RETURN_IF_ERROR(c_api::CheckIsThere(client, "client"));
    LBC_RETURN_IF_ERROR(c_api::CheckIsThere(name, "name"));
    return client->client->DeleteFamily(name);
  });
}

lb_status lb_client_download(lb_client* client, const char* name, int64_t version,
                             const char* path) {
  return c_api::Guarded([&]() -> absl::Status {
    LBC_RETURN_IF_ERROR(c_api::CheckIsThere(client, "client"));
    LBC_RETURN_IF_ERROR(c_api::CheckIsThere(path, "path"));
    return client->client->Download(c_api::TextOf(name), path, version).status();
  });
}

}  // extern "C"
