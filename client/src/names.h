// Names of resources and requests.
#pragma once

#include <string>

namespace liquidblend::client {

// "drops" -> "animations/drops"; a name that has the collection already stays as it is.
std::string ResourceName(const std::string& collection, const std::string& id_or_name);

// "animations/drops" -> "drops"; an id stays as it is.
std::string ResourceId(const std::string& collection, const std::string& id_or_name);

// A random UUID (version 4).
std::string MakeRequestId();

}  // namespace liquidblend::client
