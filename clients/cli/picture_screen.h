/// A picture that is redrawn in place on a terminal, with a line below it that stays free.
#pragma once

#include <cstdint>
#include <cstdio>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "clients/cli/terminal.h"
#include "core/base/result.h"

namespace cli {

enum class PictureWay { kBlocks, kSixel, kKitty };

/// asked: auto, blocks, sixel or kitty; empty for anything else. environment: value of a variable
/// or null. auto is kitty where the terminal itself says that it is one which speaks that protocol
/// (and no multiplexer stands between), else blocks.
std::optional<PictureWay> choose_picture_way(
    std::string_view asked, const std::function<const char*(const char*)>& environment);

struct Extent {
  int width = 1;
  int height = 1;
};

struct PicturePlan {
  int columns = 1;  ///< cells that the picture takes
  int rows = 1;
  Extent drawn;      ///< pixels that are drawn on them
  int side_max = 0;  ///< longest side to ask the service for; 0: the whole, which may be enlarged
};

/// As wide as the terminal, or as high with two lines left over; the aspect is kept. Cells of a
/// terminal that does not tell their size count as 8 by 16 pixels.
PicturePlan plan_picture(PictureWay way, Extent film, const TerminalSize& size);

/// A PNG as text for a plan. keep_cursor: as KittyPlace has it.
core::Result<std::string> draw_picture(PictureWay way, const PicturePlan& plan,
                                       std::string_view png, std::uint32_t kitty_id,
                                       bool keep_cursor);

class PictureScreen {
 public:
  /// film: pixels of the picture at full size. out: a terminal, its cursor at the begin of a line.
  PictureScreen(PictureWay way, Extent film, std::FILE* out);

  /// For the terminal as large as it is now.
  PicturePlan plan() const;
  /// Draws over the last picture, and leaves the cursor at the begin of the line below; what stands
  /// there is kept. Colours and cursor are as they were whenever a signal can end the process.
  core::Status draw(const PicturePlan& plan, std::string_view png);
  /// Other lines were printed: the next picture begins where the cursor is then.
  void leave() { placed_ = false; }

 private:
  PictureWay way_;
  Extent film_;
  std::FILE* out_;
  bool placed_ = false;
  bool drawn_ = false;
  TerminalSize size_;
  std::uint32_t kitty_id_;
};

}  // namespace cli
