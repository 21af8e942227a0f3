#include <cstdio>
#include <cstdlib>
#include <optional>

#include "clients/cli/api_client.h"
#include "clients/cli/command.h"
#include "clients/cli/follow.h"
#include "clients/cli/job_json.h"
#include "clients/cli/shown.h"
#include "clients/cli/tev_feed.h"
#include "clients/cli/watch_picture.h"

namespace cli {
namespace {

struct WatchFlags {
  ServerFlags server;
  std::string id = "latest";
  bool json = false;
  std::string picture;  ///< empty: none
  bool final_only = false;
  std::string tev;  ///< empty: none
};

using Client = std::unique_ptr<ApiClient>;

core::Result<Client> connect(const WatchFlags& flags) {
  return ApiClient::connect(flags.server.url, flags.server.key);
}

int refuse(const std::string& why) {
  complain("watch", {core::ErrorCode::kInvalidArgument, why, ""});
  return kWrongUsage;
}

/// Prints every event as a line of JSON: {"event": "progress", "data": {...}}.
core::Result<Json> follow_as_json(ApiClient& client, const std::string& path) {
  Follower follower;
  follower.on_event = [](const ServerEvent& event) {
    const Json line = {{"event", event.type}, {"data", parse_object(event.data)}};
    std::printf("%s\n", line.dump().c_str());
    std::fflush(stdout);
  };
  follower.on_trouble = [](const std::string& text) {
    std::fprintf(stderr, "%s\n", shown(text).c_str());
  };
  return follow_job(client, path, follower);
}

core::Result<Watched> watched(core::Result<Json> job) {
  if (!job) {
    return job.error();
  }
  return Watched{*std::move(job), core::ok_status()};
}

core::Result<Watched> follow(ApiClient& client, const std::string& path, const WatchFlags& flags,
                             std::optional<PictureWay> way) {
  if (flags.json) {
    return watched(follow_as_json(client, path));
  }
  if (!way) {
    return watched(follow_with_progress(client, path, stdout));
  }
  const auto before = get_json(client, path);
  if (!before) {
    return before.error();
  }
  const TevRect rect = picture_rect(*before);
  const Extent film{rect.width, rect.height};
  if (!flags.final_only) {
    const auto pictures = connect(flags);
    return pictures ? follow_with_picture(client, **pictures, path, *way, film)
                    : core::Result<Watched>(pictures.error());
  }
  auto end = watched(follow_with_progress(client, path, stderr));
  if (end) {
    end->drawn = draw_once(client, path, *way, film);
  }
  return end;
}

/// Starts sending tiles to tev, which must be running.
core::Result<std::unique_ptr<TevFeed>> feed_tev(ApiClient& client, const std::string& path,
                                                const WatchFlags& flags) {
  auto tev = TevConnection::open(flags.tev);
  if (!tev) {
    return tev.error();
  }
  const auto job = get_json(client, path);
  if (!job) {
    return job.error();
  }
  auto own = connect(flags);
  if (!own) {
    return own.error();
  }
  return std::make_unique<TevFeed>(*std::move(own), path, *std::move(tev), *job);
}

int run(const WatchFlags& flags, std::optional<PictureWay> way) {
  const auto client = connect(flags);
  if (!client) {
    return complain("watch", client.error());
  }
  const auto path = job_path(**client, flags.id);
  if (!path) {
    return complain("watch", path.error());
  }
  std::unique_ptr<TevFeed> feed;
  if (!flags.tev.empty()) {
    auto begun = feed_tev(**client, *path, flags);
    if (!begun) {
      return complain("watch", begun.error());
    }
    feed = *std::move(begun);
  }
  const auto end = follow(**client, *path, flags, way);
  if (!end) {
    return complain("watch", end.error());
  }
  if (!flags.json) {
    std::printf("%s\n", closing_text(end->job).c_str());
  }
  int code = exit_code_of(end->job);
  if (!end->drawn) {
    code = complain("watch", end->drawn.error());
  }
  if (feed != nullptr) {
    if (const auto shown = feed->finish(); !shown) {
      code = complain("watch", shown.error());
    }
  }
  return code;
}

int check_and_run(const WatchFlags& flags) {
  if (!flags.tev.empty() && !is_tev_address(flags.tev)) {
    return refuse("\"" + flags.tev +
                  "\" is not HOST:PORT for --tev; to use its default address, give the job first: "
                  "tessera watch JOB --tev");
  }
  if (flags.picture.empty()) {
    return flags.final_only ? refuse("--final requires --picture") : run(flags, std::nullopt);
  }
  const auto way = choose_picture_way(flags.picture, [](const char* name) -> const char* {
    return std::getenv(name);  // NOLINT(concurrency-mt-unsafe): before threads.
  });
  if (!way) {
    return refuse("--picture is auto, blocks, sixel or kitty, not \"" + flags.picture + "\"");
  }
  if (!is_terminal(stdout) && !flags.final_only) {
    return refuse(
        "--picture redraws in a terminal, but the output is not one; with --final one image is "
        "drawn when the job has ended");
  }
  const bool guessed = flags.picture == "auto" && !is_terminal(stdout);
  return run(flags, guessed ? PictureWay::kBlocks : *way);
}

}  // namespace

int watch(const Args& args) {
  CLI::App app(
      "Follows a job until it ends. Exit code 0 if it finished, 1 if it failed or was cancelled.",
      "tessera watch");
  WatchFlags flags;
  app.add_option("id", flags.id, "Job (the newest)")->type_name("ID");
  auto* json = app.add_flag("--json", flags.json, "Print every event as a line of JSON");
  app.add_flag("--picture{auto}", flags.picture,
               "Draw the image in the terminal while it converges; --picture=blocks, =sixel or "
               "=kitty selects how")
      ->excludes(json);
  app.add_flag("--final", flags.final_only,
               "With --picture: draw once, when finished (works in pipes)")
      ->excludes(json);
  app.add_option("--tev", flags.tev, "Show the linear tiles in the image viewer tev as they arrive")
      ->expected(0, 1)
      ->default_str(std::string(kTevAddress))
      ->type_name("HOST:PORT");
  add_server_flags(app, flags.server);
  return parse_and_run(app, args, [&] { return check_and_run(flags); });
}

}  // namespace cli
