/// FirstImages: encodes the images that the page opens a job with, as soon as the job ends, and
/// stores them beside its film.
#pragma once

#include <vector>

#include "server/jobs/background.h"
#include "server/jobs/job.h"
#include "server/routes/context.h"
#include "server/routes/first_image_file.h"

namespace server {

class FirstImages {
 public:
  explicit FirstImages(RouteContext context);
  ~FirstImages();
  FirstImages(const FirstImages&) = delete;
  FirstImages& operator=(const FirstImages&) = delete;

 private:
  /// Keeps the job's thumbnail and its image (clients/web/src/view: thumbnail.tsx, first_look.tsx).
  /// Without memory or a film they are encoded when they are asked for.
  void encode(const JobPointer& job) const;
  void store(Job& job, const api::JobView& view, const std::vector<FirstImage>& images) const;
  void remove_parts() const;

  const RouteContext context_;
  Background background_;
};

}  // namespace server
