#include "clients/cli/look_flags.h"

#include "api/queries/look_ranges.h"

namespace cli {

void add_look_options(CLI::App& app, LookFlags& flags) {
  app.add_option("--white-balance", flags.white_balance_k,
                 "Colour temperature of the light that is shown as white, in kelvin (2700 for "
                 "lamps); only for .png, .jpg, .webp and .avif")
      ->check(CLI::Range(api::kWhiteKelvin.min, api::kWhiteKelvin.max))
      ->type_name("K");
  app.add_option("--contrast", flags.contrast,
                 "Stops that one stop of the scene becomes (1); only for .png, .jpg, .webp and "
                 ".avif")
      ->check(CLI::Range(api::kContrast.min, api::kContrast.max))
      ->type_name("C");
  app.add_option("--bits", flags.bits, "Bits of each channel: 8, or 16 for .png (8)")
      ->check(CLI::IsMember({8, 16}))
      ->type_name("N");
}

core::Status check_look_flags(const LookFlags& flags, const std::string& format, bool is_linear) {
  const auto refused = [&](std::string why, const char* flag) {
    return core::Error{core::ErrorCode::kInvalidArgument, std::move(why), flag};
  };
  if (flags.bits == 16 && format != "png") {
    return refused("16 is for .png", "--bits");
  }
  const bool balances = flags.white_balance_k.has_value();
  if (is_linear && (balances || flags.contrast != 1)) {
    return refused("is for .png, .jpg, .webp and .avif; ." + format + " is linear",
                   balances ? "--white-balance" : "--contrast");
  }
  return core::ok_status();
}

}  // namespace cli
