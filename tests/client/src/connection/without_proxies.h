// An environment that names no proxies.
#pragma once

#include <cstdlib>

namespace liquidblend::client {

// Forgets the proxies of the environment now, and again at its end, for tests that set some.
// Threads: none beside it reads the environment.
class WithoutProxies {
 public:
  WithoutProxies() { Forget(); }
  ~WithoutProxies() { Forget(); }
  WithoutProxies(const WithoutProxies&) = delete;
  WithoutProxies& operator=(const WithoutProxies&) = delete;

 private:
  static void Forget() {
    for (const char* name :
         {"http_proxy", "https_proxy", "HTTPS_PROXY", "all_proxy", "ALL_PROXY", "no_proxy"}) {
      unsetenv(name);
    }
  }
};

}  // namespace liquidblend::client
