#include "clients/cli/picture_screen.h"

#include <algorithm>
#include <cmath>

#include <unistd.h>

#include "clients/cli/picture.h"

namespace cli {
namespace {

// A process alternates between two image ids, so that one image stays visible while the next
// arrives.
constexpr std::uint32_t kIdsOfProcess = 2;

constexpr const char* kSaveCursor = "\0337";
constexpr const char* kRestoreCursor = "\0338";

bool starts_with(const char* text, std::string_view head) {
  return text != nullptr && std::string_view(text).starts_with(head);
}

bool speaks_kitty(const std::function<const char*(const char*)>& environment) {
  const char* term = environment("TERM");
  if (environment("TMUX") != nullptr || starts_with(term, "screen") || starts_with(term, "tmux")) {
    return false;
  }
  const char* program = environment("TERM_PROGRAM");
  return starts_with(term, "xterm-kitty") || starts_with(term, "xterm-ghostty") ||
         environment("KITTY_WINDOW_ID") != nullptr || starts_with(program, "kitty") ||
         starts_with(program, "ghostty");
}

int at_least_one(double value) { return std::max(1, static_cast<int>(value)); }

}  // namespace

std::optional<PictureWay> choose_picture_way(
    std::string_view asked, const std::function<const char*(const char*)>& environment) {
  if (asked == "auto") {
    return speaks_kitty(environment) ? PictureWay::kKitty : PictureWay::kBlocks;
  }
  if (asked == "blocks") {
    return PictureWay::kBlocks;
  }
  if (asked == "sixel") {
    return PictureWay::kSixel;
  }
  return asked == "kitty" ? std::optional(PictureWay::kKitty) : std::nullopt;
}

PicturePlan plan_picture(PictureWay way, Extent film, const TerminalSize& size) {
  Extent cell{8, 16};
  if (way == PictureWay::kBlocks) {
    cell = {1, 2};
  } else if (size.width_px >= size.columns && size.height_px >= size.rows) {
    cell = {size.width_px / size.columns, size.height_px / size.rows};
  }
  const int columns_max = std::max(1, size.columns);
  const int rows_max = std::max(1, size.rows - 2);
  const double scale = std::min(static_cast<double>(columns_max) * cell.width / film.width,
                                static_cast<double>(rows_max) * cell.height / film.height);
  const int longest = std::max(film.width, film.height);
  PicturePlan plan;
  double ratio = scale;
  if (scale < 1) {  // the server rounds the longest side
    plan.side_max = at_least_one(std::floor(longest * scale + 1e-9));
    ratio = static_cast<double>(plan.side_max) / longest;
  }
  const int width_max = columns_max * cell.width;
  const int height_max = rows_max * cell.height;
  plan.drawn = {std::clamp(static_cast<int>(std::lround(film.width * ratio)), 1, width_max),
                std::clamp(static_cast<int>(std::lround(film.height * ratio)), 1, height_max)};
  plan.columns = (plan.drawn.width + cell.width - 1) / cell.width;
  plan.rows = (plan.drawn.height + cell.height - 1) / cell.height;
  return plan;
}

core::Result<std::string> draw_picture(PictureWay way, const PicturePlan& plan,
                                       std::string_view png, std::uint32_t kitty_id,
                                       bool keep_cursor) {
  if (way == PictureWay::kKitty) {
    return draw_kitty(png, {plan.columns, plan.rows, kitty_id, keep_cursor});
  }
  auto picture = decode_png(png);
  if (!picture) {
    return picture.error();
  }
  if (picture->width != plan.drawn.width || picture->height != plan.drawn.height) {
    picture = enlarged(*picture, plan.drawn.width, plan.drawn.height);
  }
  return way == PictureWay::kSixel ? draw_sixel(*picture) : draw_blocks(*picture);
}

PictureScreen::PictureScreen(PictureWay way, Extent film, std::FILE* out)
    : way_(way),
      film_(film),
      out_(out),
      kitty_id_(static_cast<std::uint32_t>(getpid()) * kIdsOfProcess) {}

PicturePlan PictureScreen::plan() const { return plan_picture(way_, film_, terminal_size(out_)); }

core::Status PictureScreen::draw(const PicturePlan& plan, std::string_view png) {
  const std::uint32_t before = kitty_id_;
  const std::uint32_t next = before ^ 1U;
  const auto drawing = draw_picture(way_, plan, png, next, true);
  if (!drawing) {
    return drawing.error();
  }
  std::string frame =
      "\x1b[?2026h\x1b[?25l";  // synchronized update, if supported; hides the cursor
  const TerminalSize size = terminal_size(out_);
  if (placed_ && !(size == size_)) {  // lines have been rewrapped
    frame += "\x1b[2J\x1b[H";
    placed_ = false;
  }
  const std::string rows = std::to_string(plan.rows);
  if (!placed_) {
    frame.append(static_cast<std::size_t>(plan.rows), '\n');
  }
  frame += "\r\x1b[" + rows + "A" + kSaveCursor + *drawing + kRestoreCursor + "\x1b[" + rows + "B";
  if (way_ == PictureWay::kKitty && drawn_) {
    frame += drop_kitty(before);
  }
  frame += "\x1b[0m\x1b[?25h\x1b[?2026l";
  const SignalsHeld held;
  std::fwrite(frame.data(), 1, frame.size(), out_);
  std::fflush(out_);
  placed_ = true;
  drawn_ = true;
  size_ = size;
  kitty_id_ = next;
  return core::ok_status();
}

}  // namespace cli
