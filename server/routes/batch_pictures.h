/// The pictures of all jobs of a batch: as an archive, and on one sheet.
#pragma once

#include <string>
#include <vector>

#include "api/batch.h"
#include "core/base/result.h"
#include "core/image_io/image_io.h"
#include "server/http/message.h"
#include "server/jobs/job_service.h"
#include "server/pictures/picture.h"
#include "server/routes/context.h"

namespace server {

class BatchPictures {
 public:
  /// What it borrows outlives it: the routes' parts live as long as the server.
  BatchPictures(const RouteContext& context, api::ImageQuery look)
      : jobs_(context.jobs),
        denoising_(context.denoising),
        memory_(context.memory),
        log_(context.log),
        maker_(context.memory, context.about),
        look_(std::move(look)) {}

  core::Result<EncodedPicture> picture(const JobPointer& job, const core::ImageFormat& format,
                                       const api::ImageQuery& look) const;
  /// One entry for each job, in their order; first: the picture of the first one. Ends without a
  /// directory, so that no reader takes it for whole, when a picture cannot be made.
  void write_archive(const std::vector<JobPointer>& jobs, const EncodedPicture& first,
                     const core::ImageFormat& format, StreamWriter& writer) const;
  /// A PNG, row by row in the order of the jobs. Errors: kUnavailable without memory.
  core::Result<std::string> sheet(const std::vector<JobPointer>& jobs,
                                  const core::ImageFormat& png) const;

 private:
  JobService& jobs_;
  DenoiseService& denoising_;
  MemoryGate& memory_;
  Log& log_;
  PictureMaker maker_;
  api::ImageQuery look_;
};

}  // namespace server
