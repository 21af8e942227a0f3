/// Redraws an image in place on a terminal, above a line that stays free.
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

/// Selects the way of drawing. asked: auto, blocks, sixel or kitty; returns empty for anything
/// else. environment: returns a variable or null. auto is kitty if the terminal identifies itself
/// as one that supports that protocol (and no multiplexer is in between), otherwise blocks.
std::optional<PictureWay> choose_picture_way(
    std::string_view asked, const std::function<const char*(const char*)>& environment);

struct Extent {
  int width = 1;
  int height = 1;
};

struct PicturePlan {
  int columns = 1;  ///< cells covered by the image
  int rows = 1;
  Extent drawn;      ///< size in pixels as drawn
  int side_max = 0;  ///< longest side to request from the server; 0: full size, possibly enlarged
};

/// Plans an image as wide as the terminal, or as high except two lines, with its aspect ratio.
/// Cells of unknown size count as 8 by 16 pixels.
PicturePlan plan_picture(PictureWay way, Extent film, const TerminalSize& size);

/// Draws a PNG as text for a plan. keep_cursor: as in KittyPlace.
core::Result<std::string> draw_picture(PictureWay way, const PicturePlan& plan,
                                       std::string_view png, std::uint32_t kitty_id,
                                       bool keep_cursor);

class PictureScreen {
 public:
  /// film: pixels of the image at full size. out: a terminal with its cursor at the start of a
  /// line.
  PictureScreen(PictureWay way, Extent film, std::FILE* out);

  /// Plans for the current size of the terminal.
  PicturePlan plan() const;
  /// Draws over the last image and moves the cursor to the start of the line below, whose content
  /// is kept. Whenever a signal can end the process, colours and cursor are in their normal state.
  core::Status draw(const PicturePlan& plan, std::string_view png);
  /// Call after printing other lines: the next image begins at the cursor.
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
