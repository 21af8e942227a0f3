/// Images of all jobs of a batch: as an archive, and as a contact sheet.
#pragma once

#include <functional>
#include <string>
#include <string_view>
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
  /// context must outlive this, as route contexts do.
  BatchPictures(const RouteContext& context, api::ImageQuery look)
      : jobs_(context.jobs),
        denoising_(context.denoising),
        memory_(context.memory),
        log_(context.log),
        maker_(context.memory, context.about),
        look_(std::move(look)) {}

  core::Result<EncodedPicture> picture(const JobPointer& job, const core::ImageFormat& format,
                                       const api::ImageQuery& look) const;
  /// Receives a piece; returns false to end the archive.
  using Sink = std::function<bool(std::string_view piece)>;
  /// Writes one entry for each job, in order; first: the image of the first job. If an image cannot
  /// be made, the archive ends without a directory, so that no reader takes it for complete.
  core::Status write_archive(const std::vector<JobPointer>& jobs, const EncodedPicture& first,
                             const core::ImageFormat& format, const Sink& sink) const;
  /// Returns the same as a file of `folder` without a name. Errors: also kNoSpace.
  core::Result<FileBody> archive_file(const std::vector<JobPointer>& jobs,
                                      const EncodedPicture& first, const core::ImageFormat& format,
                                      const std::string& folder) const;
  /// Returns a PNG with the jobs' images row by row, in order. Errors: kUnavailable without memory.
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
