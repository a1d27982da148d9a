// The header of the C API in C++17, with the shared library and nothing else of ours.
#include <liquidblend/liquidblend.h>

#include <memory>
#include <string>

namespace {

struct FreePlayer {
  void operator()(lb_player* player) const { lb_player_free(player); }
};

}  // namespace

int main() {
  lb_player_options options = {};
  options.struct_size = sizeof options;
  options.file = "no such file";
  lb_player* opened = nullptr;
  const lb_status status = lb_player_open(&options, &opened);
  const std::unique_ptr<lb_player, FreePlayer> player(opened);
  const bool is_refused = status == LB_NOT_FOUND && player == nullptr &&
                          std::string(lb_last_error()).find(options.file) != std::string::npos;
  return is_refused && lb_version() > 0 ? 0 : 1;
}
