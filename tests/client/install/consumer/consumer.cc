// Compiles with every public header, links, and runs as far as it can without a server.
#include <liquidblend/animation.h>
#include <liquidblend/bounds.h>
#include <liquidblend/client.h>
#include <liquidblend/decode.h>
#include <liquidblend/family.h>
#include <liquidblend/frame.h>
#include <liquidblend/frame_stream.h>
#include <liquidblend/mesh.h>
#include <liquidblend/operation.h>

int main() {
  liquidblend::ConnectOptions options;
  options.target = "127.0.0.1:1";
  options.connect_timeout = absl::Milliseconds(20);
  const bool unreachable = absl::IsUnavailable(liquidblend::Client::Connect(options).status());
  const bool refused = !liquidblend::DecodeMesh("no mesh").ok();
  return unreachable && refused ? 0 : 1;
}
