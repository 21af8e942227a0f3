/// `tessera watch --picture`: shows the image of a job in the terminal while it converges.
#pragma once

#include <string>

#include "clients/cli/api_client.h"
#include "clients/cli/job_flags.h"
#include "clients/cli/picture_screen.h"

namespace cli {

struct Watched {
  Json job;                                ///< after its end
  core::Status drawn = core::ok_status();  ///< why the last image could not be drawn
};

/// Runs follow_with_progress() with the image above the bar, redrawn when tiles arrive, at most
/// three times per second. stdout is a terminal. pictures: a second connection, for the images
/// alone.
core::Result<Watched> follow_with_picture(ApiClient& client, ApiClient& pictures,
                                          const std::string& path, PictureWay way, Extent film);

/// Draws the current image once to stdout, which may be a pipe (then as wide as COLUMNS, or 80).
core::Status draw_once(ApiClient& client, const std::string& path, PictureWay way, Extent film);

}  // namespace cli
