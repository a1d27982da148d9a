#include "client/cli/flags/encoding_flags.h"

#include <CLI/CLI.hpp>
#include <string>

#include "client/cli/flags/named_value.h"
#include "client/cli/flags/number_checks.h"

namespace liquidblend::cli {

void AddEncodingFlags(CLI::App& command, EncodingFlags& flags) {
  CLI::Option* const bits =
      command.add_option("--bits", flags.position_bits, "Bits per coordinate")
          ->check(CLI::Range(8, 20));
  bits->default_str(flags.position_bits != 0 ? std::to_string(flags.position_bits) : "14");
  command
      .add_option("--step", flags.position_step_m,
                  "Longest step that coordinates are rounded to, metres; otherwise by --bits")
      ->check(Positive())
      ->excludes(bits);
  AddNamedValue<EncodingPreset>("--encoding", flags.preset,
                                "The server's time against bytes; the same triangles (fastest)",
                                {{"fastest", EncodingPreset::kFastest},
                                 {"balanced", EncodingPreset::kBalanced},
                                 {"smallest", EncodingPreset::kSmallest}},
                                command);
}

}  // namespace liquidblend::cli
