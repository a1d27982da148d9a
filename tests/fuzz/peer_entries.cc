#include "tests/fuzz/entries.h"

namespace liquidblend::fuzz {
namespace {

constexpr Entry kEntries[] = {{"http", RunHttp},     {"websocket", RunWebSocket},
                              {"stream", RunStream}, {"tokens", RunTokens},
                              {"upload", RunUpload}, {"pages", RunPages}};

}  // namespace

std::span<const Entry> PeerEntries() { return kEntries; }

}  // namespace liquidblend::fuzz
