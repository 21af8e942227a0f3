#include "server/routes/first_images.h"

#include <filesystem>
#include <string>
#include <string_view>
#include <utility>

#include "core/settings/choices.h"
#include "server/routes/picture_answer.h"

namespace server {

using core::Error;
using core::ErrorCode;
using core::Status;

FirstImages::FirstImages(RouteContext context)
    : context_(std::move(context)), background_(1, 1, Background::Priority::kNormal) {
  remove_parts();
  context_.jobs.journal().on_state([this](const Job& changed, api::JobState state) {
    if (!api::is_final(state)) {
      return;
    }
    background_.post(
        [this, id = changed.id()] {
          if (const auto job = context_.jobs.find(id, Access::operators())) {
            encode(*job);
          }
        },
        changed.tenant());
  });
}

FirstImages::~FirstImages() {
  context_.jobs.stop();  // Jobs still run if the server failed to start.
  context_.jobs.journal().forget_listeners();
}

void FirstImages::encode(const JobPointer& job) const {
  const api::JobView view = context_.jobs.view(*job);
  if (view.film_digest.empty()) {
    return;
  }
  std::vector<FirstImage> images;
  const auto keep = [&](std::string_view extension, const api::ImageQuery& query) {
    Request request;
    request.access = Access::of(job->tenant());
    const Response made =
        picture_answer(context_, request, job, *choose_format(request, extension), query);
    const std::string key = kept_key(view, made.headers.find("ETag").value_or(""));
    if (const auto kept = context_.pictures.peek(job->id() + key)) {
      images.push_back({.key = key, .picture = *kept});
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
    store(*job, view, images);
  }
}

void FirstImages::store(Job& job, const api::JobView& view,
                        const std::vector<FirstImage>& images) const {
  const std::string text = first_images_text(images);
  StorageQuota::Room room = context_.quota.room(job.tenant(), StorageQuota::Kind::kFilm);
  const auto modify = [&](JobRecord& record) -> Verdict {
    if (record.film != FilmPlace::kOnDisk || record.view.film_digest != view.film_digest) {
      return Error{ErrorCode::kCancelled, "the job goes on, or its film is gone", ""};
    }
    if (!context_.quota.has_disk_room()) {
      return Error{ErrorCode::kNoSpace, "the disk is full", ""};
    }
    if (const Status fits = room.grow_to(text.size()); !fits) {
      return fits.error();
    }
    if (const Status stored = write_first_images(context_.data.first_images_path(job.id()), text);
        !stored) {
      return stored.error();
    }
    record.film_bytes += text.size();
    return {};
  };
  const Verdict stored =
      context_.jobs.journal().change(job, modify, {.unstored = Journal::Unstored::kInMemory});
  if (!stored && !stored.is(ErrorCode::kCancelled) && !stored.is(ErrorCode::kNotFound)) {
    context_.log.write(LogLevel::kWarning, "look_not_stored",
                       {{"job", job.id()}, {"detail", stored.error()->message}});
  }
}

void FirstImages::remove_parts() const {
  std::error_code ignored;  // A part only costs space; `tessera check` lists it.
  for (const auto& entry :
       std::filesystem::directory_iterator(context_.data.first_images_path(), ignored)) {
    if (entry.path().extension() == kPartEnd) {
      std::filesystem::remove(entry.path(), ignored);
    }
  }
}

}  // namespace server
