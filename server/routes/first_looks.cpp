#include "server/routes/first_looks.h"

#include <string>
#include <string_view>
#include <utility>

#include "core/settings/registry.h"
#include "server/routes/picture_answer.h"

namespace server {

FirstLooks::FirstLooks(RouteContext context)
    : context_(std::move(context)), background_(1, 1, Background::Priority::kNormal) {
  context_.jobs.journal().on_end([this](const Job& ended) {
    background_.post(
        [this, id = ended.id()] {
          if (const auto job = context_.jobs.find(id, Access::operators())) {
            encode(*job);
          }
        },
        ended.tenant());
  });
}

FirstLooks::~FirstLooks() {
  context_.jobs.stop();  // Jobs still run if the server failed to start.
  context_.jobs.journal().forget_listeners();
}

void FirstLooks::encode(const JobPointer& job) const {
  const api::JobView view = context_.jobs.view(*job);
  if (view.film_digest.empty()) {
    return;
  }
  std::vector<StoredLook> looks;
  const auto keep = [&](std::string_view extension, const api::ImageQuery& query) {
    Request request;
    request.access = Access::of(job->tenant());
    const Response made =
        picture_answer(context_, request, job, *choose_format(request, extension), query);
    const std::string key = kept_key(view, made.headers.find("ETag").value_or(""));
    if (const auto kept = context_.pictures.peek(job->id() + key)) {
      looks.push_back({.key = key, .picture = *kept});
    }
  };
  // First the image, which takes longer: the thread of another request encodes the thumbnail.
  api::ImageQuery image;
  image.auto_exposure = true;
  keep(core::is_transparent(view.spec.render) ? "webp" : "jpg", image);
  api::ImageQuery thumbnail;
  thumbnail.max_size = 192;
  keep("png", thumbnail);
  if (!job->memory_only()) {
    store(*job, view, looks);
  }
}

void FirstLooks::store(Job& job, const api::JobView& view,
                       const std::vector<StoredLook>& looks) const {
  const core::MutexLock changing(job.change_mutex());
  const JobRecord record = job.record();
  if (job.is_removed() || record.film != FilmPlace::kOnDisk ||
      record.view.film_digest != view.film_digest || !context_.quota.has_disk_room()) {
    return;
  }
  const core::Status stored = write_looks(context_.data.look_path(job.id()), looks);
  if (!stored) {
    context_.log.write(LogLevel::kWarning, "look_not_stored",
                       {{"job", job.id()}, {"detail", stored.error().message}});
  }
}

}  // namespace server
