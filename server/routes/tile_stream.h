/// GET /v1/jobs/{id}/tiles: sends a film to one client, tile by tile, newest revisions only.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "api/answers/tile_frame.h"
#include "api/requests.h"
#include "core/film/film.h"
#include "server/http/message.h"
#include "server/http/stream_gate.h"
#include "server/jobs/denoise_service.h"
#include "server/jobs/job_service.h"
#include "server/jobs/tile_frames.h"

namespace server {

/// Returns means, variances of the mean (NaN with one half) and counts of one tile; only means with
/// kTileMean in flags. flags: only kTileAlpha and kTileMean matter.
api::TileFrame tile_frame(const core::TileState& state, int replicates, std::uint32_t flags);

/// Returns r g b of one tile of a denoised image.
api::TileFrame denoised_frame(const core::DenoisedPicture& picture, core::DenoiseMode mode,
                              const core::PixelRect& tile);

class TileStream {
 public:
  struct Parts {
    JobService& jobs;
    DenoiseService& denoising;
    TileFrames& frames;
    const StreamGate& streams;  ///< the interval between looks at the film grows with their number
  };
  /// query.after: the client has all revisions up to this one.
  TileStream(const Parts& parts, JobPointer job, const api::TilesQuery& query);

  /// Sends until the job has ended or the client has disconnected; the end frame comes last.
  void run(StreamWriter& writer);

 private:
  /// Returns false when the client has disconnected.
  bool send_new_tiles(StreamWriter& writer, const core::Film& film, bool is_final);
  bool send_denoised(StreamWriter& writer, const core::Film& film, bool is_final);

  const Parts parts_;
  const JobPointer job_;
  const api::TilesQuery query_;
  std::vector<std::uint32_t> sent_;  ///< Newest revision sent, by tile.
  std::string piece_;                ///< Frames to send; keeps its memory.
  std::uint32_t denoised_sent_ = 0;
};

}  // namespace server
