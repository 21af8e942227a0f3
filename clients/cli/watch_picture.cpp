#include "clients/cli/watch_picture.h"

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <utility>

#include "clients/cli/follow.h"
#include "clients/cli/job_json.h"
#include "clients/cli/progress.h"

namespace cli {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kBetweenPictures{330};
// Limits drawing to one part in four of the time on a slow terminal or connection.
constexpr int kRestAfterWork = 3;

core::Result<std::string> get_png(ApiClient& client, const std::string& path,
                                  const PicturePlan& plan) {
  const std::string size = plan.side_max > 0 ? "?max_size=" + std::to_string(plan.side_max) : "";
  auto reply = client.get(path + "/image.png" + size);
  if (!reply) {
    return reply.error();
  }
  return std::move(reply->body);
}

core::Status draw_newest(PictureScreen& screen, ApiClient& pictures, const std::string& path) {
  const PicturePlan plan = screen.plan();
  const auto png = get_png(pictures, path, plan);
  return png ? screen.draw(plan, *png) : core::Status(png.error());
}

/// Redraws when there is a new image and enough time has passed.
class Redraw {
 public:
  Redraw(PictureScreen& screen, ApiClient& pictures, std::string path, ProgressPrinter& printer)
      : screen_(screen), pictures_(pictures), path_(std::move(path)), printer_(printer) {}

  void mark() { changed_ = true; }
  void draw_if_due() {
    const auto begin = Clock::now();
    if (!changed_ || begin < next_) {
      return;
    }
    changed_ = false;
    if (const auto drawn = draw_newest(screen_, pictures_, path_); !drawn && !told_) {
      printer_.say("no image: " + drawn.error().message);
      screen_.leave();
      told_ = true;
    }
    const auto end = Clock::now();
    next_ = std::max(begin + kBetweenPictures, end + kRestAfterWork * (end - begin));
  }

 private:
  PictureScreen& screen_;
  ApiClient& pictures_;
  std::string path_;
  ProgressPrinter& printer_;
  bool changed_ = false;
  bool told_ = false;
  Clock::time_point next_;
};

}  // namespace

core::Result<Watched> follow_with_picture(ApiClient& client, ApiClient& pictures,
                                          const std::string& path, PictureWay way, Extent film) {
  ProgressPrinter printer(stdout);
  PictureScreen screen(way, film, stdout);
  Redraw redraw(screen, pictures, path, printer);
  Json job = Json::object();
  const auto say = [&](const std::string& text) {
    printer.say(text);
    screen.leave();
  };
  Follower follower;
  follower.on_event = [&](const ServerEvent& event) {
    if (event.type == "tile") {
      redraw.mark();
    } else if (event.type == "warning") {
      say("warning: " + text_at(parse_object(event.data), "message"));
    } else if (event.type == "snapshot" || event.type == "progress" || event.type == "state") {
      job.update(parse_object(event.data));
    }
    if (is_final_state(text_at(job, "state"))) {
      return;  // the last image is drawn after the end
    }
    redraw.draw_if_due();
    if (event.type != "tile" && !job.empty()) {
      printer.show(facts_of(job));
    }
  };
  follower.on_trouble = say;
  auto ended = follow_job(client, path, follower);
  printer.clear();
  if (!ended) {
    return ended.error();
  }
  return Watched{*std::move(ended), draw_newest(screen, pictures, path)};
}

core::Status draw_once(ApiClient& client, const std::string& path, PictureWay way, Extent film) {
  if (is_terminal(stdout)) {
    PictureScreen screen(way, film, stdout);
    return draw_newest(screen, client, path);
  }
  TerminalSize size;
  if (const char* columns = std::getenv("COLUMNS");
      columns != nullptr) {  // NOLINT(concurrency-mt-unsafe)
    const auto told = std::strtol(columns, nullptr, 10);
    size.columns = told > 0 && told < 10000 ? static_cast<int>(told) : size.columns;
  }
  size.rows = size.columns;  // no redraw, so only the width limits the size, except for tall images
  const PicturePlan plan = plan_picture(way, film, size);
  const auto png = get_png(client, path, plan);
  if (!png) {
    return png.error();
  }
  const auto drawing = draw_picture(way, plan, *png, 1, false);
  if (!drawing) {
    return drawing.error();
  }
  std::printf("%s%s", drawing->c_str(), way == PictureWay::kBlocks ? "" : "\n");
  return core::ok_status();
}

}  // namespace cli
