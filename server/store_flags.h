// The flags that say where a program's store is: the same for the server and liquidblend-admin.
#pragma once

#include <CLI/App.hpp>

#include "core/store/open_store.h"

namespace liquidblend::server {

void AddStoreFlags(CLI::App& app, store::StoreLocation& location);

}  // namespace liquidblend::server
