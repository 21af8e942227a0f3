#include "server/routes/first_looks.h"

#include <string>
#include <string_view>
#include <utility>

#include "core/settings/registry.h"
#include "server/routes/picture_answer.h"

namespace server {

FirstLooks::FirstLooks(RouteContext context)
    : context_(std::move(context)), background_(1, 1, Background::Priority::kOfRendering) {
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
  const auto keep = [&](std::string_view extension, const api::ImageQuery& query) {
    Request request;
    request.access = Access::of(job->tenant());
    picture_answer(context_, request, job, *choose_format(request, extension), query);
  };
  api::ImageQuery thumbnail;
  thumbnail.max_size = 192;
  keep("png", thumbnail);
  api::ImageQuery image;
  image.auto_exposure = true;
  keep(core::is_transparent(view.spec.render) ? "webp" : "jpg", image);
}

}  // namespace server
