/// `tessera watch --picture`: the picture of a job in the terminal while it converges.
#pragma once

#include <string>

#include "clients/cli/api_client.h"
#include "clients/cli/job_flags.h"
#include "clients/cli/picture_screen.h"

namespace cli {

struct Watched {
  Json job;                                ///< at its end
  core::Status drawn = core::ok_status();  ///< why there is no last picture
};

/// follow_with_progress() with the picture above the bar, drawn anew when tiles came, at most three
/// times a second. stdout is a terminal. pictures: a second connection, for the pictures alone.
core::Result<Watched> follow_with_picture(ApiClient& client, ApiClient& pictures,
                                          const std::string& path, PictureWay way, Extent film);

/// The picture as it is, once, on stdout, which may be a pipe (then as wide as COLUMNS says, or
/// 80).
core::Status draw_once(ApiClient& client, const std::string& path, PictureWay way, Extent film);

}  // namespace cli
