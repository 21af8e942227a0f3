#include "server/routes/batch_pictures.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <span>
#include <utility>

#include <fcntl.h>

#include "core/base/zip_writer.h"
#include "server/pictures/denoised_facts.h"
#include "server/store/files.h"
#include "server/store/uuid.h"

namespace server {

using core::Error;

namespace {

// Size of a sheet's thumbnails, in pixels, and the longest side of a sheet. Many jobs get smaller
// thumbnails: a sheet of 512 jobs, 23 in a row, then needs no more memory than a picture of 4
// megapixels.
constexpr int kCell = 240;
constexpr int kGap = 8;
constexpr int kSheetSide = 2048;

struct Grid {
  explicit Grid(std::size_t jobs)
      : columns(std::max(1, static_cast<int>(std::ceil(std::sqrt(static_cast<double>(jobs)))))),
        rows((static_cast<int>(jobs) + columns - 1) / columns),
        cell(std::min(kCell, kSheetSide / columns - kGap)) {}
  int width() const { return columns * (cell + kGap) + kGap; }
  int height() const { return rows * (cell + kGap) + kGap; }
  int columns;
  int rows;
  int cell;
};

/// Converts grey, grey with alpha, RGB or RGBA of 8 or 16 bits to three channels in [0,1].
void paste(const core::Image& image, core::FloatImage& sheet, int left, int top) {
  const auto value = [&image](std::size_t index) {
    if (image.type == core::PixelType::kU16) {
      const auto low = std::to_integer<unsigned>(image.bytes[2 * index]);
      const auto high = std::to_integer<unsigned>(image.bytes[2 * index + 1]);
      return static_cast<float>(low | (high << 8U)) / 65535.0F;
    }
    return static_cast<float>(std::to_integer<unsigned>(image.bytes[index])) / 255.0F;
  };
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      const std::size_t pixel =
          (static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width) +
           static_cast<std::size_t>(x)) *
          static_cast<std::size_t>(image.channels);
      for (int channel = 0; channel < 3; ++channel) {
        const int from = image.channels >= 3 ? channel : 0;
        sheet.values[sheet.index(left + x, top + y, channel)] =
            value(pixel + static_cast<std::size_t>(from));
      }
    }
  }
}

/// All images get the automatic exposure of the first, so that they can be compared and played.
api::ImageQuery with_exposure_of_first(api::ImageQuery look, const EncodedPicture& first) {
  if (look.auto_exposure && first.exposure_stops) {
    look.auto_exposure = false;
    look.exposure_stops = *first.exposure_stops;
  }
  return look;
}

}  // namespace

core::Result<EncodedPicture> BatchPictures::picture(const JobPointer& job,
                                                    const core::ImageFormat& format,
                                                    const api::ImageQuery& look) const {
  const auto film = jobs_.films().film(*job);
  if (!film) {
    Error error = film.error();
    error.message = "job \"" + job->record().view.spec.name + "\": " + error.message;
    return error;
  }
  DenoiseService::Pointer denoised;
  if (wants_denoised(look)) {
    auto made = denoising_.get(job, **film, {look.denoise}, MemoryGate::kPatience);
    if (!made) {
      return made.error();
    }
    denoised = *std::move(made);
  }
  const api::JobView view = jobs_.view(*job);
  Picture wanted{.format = format, .query = look, .view = view, .rect = (*film)->crop()};
  wanted.tenant = job->tenant();
  if (wants_names(format, view.spec.render.film)) {
    const auto scene = jobs_.scene_view(*job);
    wanted.scene = scene ? scene->scene : nullptr;
  }
  if (denoised) {
    wanted.denoised = std::shared_ptr<const core::DenoisedPicture>(denoised, &denoised->picture);
    wanted.denoised_view = denoised->view;
  }
  return maker_.make(**film, wanted, MemoryGate::kPatience);
}

core::Status BatchPictures::write_archive(const std::vector<JobPointer>& jobs,
                                          const EncodedPicture& first,
                                          const core::ImageFormat& format, const Sink& sink) const {
  const api::ImageQuery look = with_exposure_of_first(look_, first);
  core::ZipWriter zip;
  std::set<std::string> names;
  for (const JobPointer& job : jobs) {
    const auto made =
        job == jobs.front() ? core::Result<EncodedPicture>(first) : picture(job, format, look);
    if (!made) {
      log_.write(LogLevel::kError, "archive_ended",
                 {{"job", job->id()}, {"detail", made.error().message}});
      return made.error();
    }
    const std::string name = core::file_name_of(job->record().view.spec.name);
    std::string unlike = name;
    for (int i = 2; !names.insert(unlike).second; ++i) {
      unlike = name + "-" + std::to_string(i);
    }
    unlike.append(".").append(format.extension);
    if (!sink(zip.begin_entry(unlike, *made->content)) || !sink(*made->content)) {
      return core::ok_status();
    }
  }
  sink(zip.end());
  return core::ok_status();
}

core::Result<FileBody> BatchPictures::archive_file(const std::vector<JobPointer>& jobs,
                                                   const EncodedPicture& first,
                                                   const core::ImageFormat& format,
                                                   const std::string& folder) const {
  const std::string path = folder + "/archive-" + make_uuid() + ".part";
  auto file = open_file(path, O_RDWR | O_CREAT | O_EXCL);
  if (!file) {
    return file.error();
  }
  if (const core::Status unnamed = remove_file(path); !unnamed) {
    return unnamed.error();
  }
  std::uint64_t bytes = 0;
  core::Status stored = core::ok_status();
  const core::Status made = write_archive(jobs, first, format, [&](std::string_view piece) {
    stored = write_at(file->get(), std::as_bytes(std::span(piece)), bytes, path);
    bytes += piece.size();
    return stored.has_value();
  });
  if (!made || !stored) {
    return made ? stored.error() : made.error();
  }
  return FileBody(file->release(), 0, bytes);
}

core::Result<std::string> BatchPictures::sheet(const std::vector<JobPointer>& jobs,
                                               const core::ImageFormat& png) const {
  const Grid grid(jobs.size());
  core::FloatImage sheet{.width = grid.width(),
                         .height = grid.height(),
                         .channel_names = {"R", "G", "B"},
                         .values = {}};
  const std::size_t count =
      static_cast<std::size_t>(sheet.width) * static_cast<std::size_t>(sheet.height) * 3;
  const auto lease =
      memory_.take({.bytes = count * sizeof(float) +
                             core::encoding_bytes(sheet.width, sheet.height, 3, png, look_.bits),
                    .tenant = jobs.empty() ? std::string() : jobs.front()->tenant()},
                   "the sheet");
  if (!lease) {
    return lease.error();
  }
  sheet.values.assign(count, 1.0F);
  api::ImageQuery look = look_;
  look.max_size = grid.cell;
  if (!look.background && !look.layer) {
    look.background = core::Rgb{1, 1, 1};
  }
  for (std::size_t i = 0; i < jobs.size(); ++i) {
    const auto made = picture(jobs[i], png, look);
    if (!made) {
      continue;  // Nothing rendered yet, or the film is gone.
    }
    look = with_exposure_of_first(look, *made);
    const auto image =
        core::decode_image(std::as_bytes(std::span(*made->content)), core::ImageLimits{});
    if (!image) {
      return image.error();
    }
    const int column = static_cast<int>(i) % grid.columns;
    const int row = static_cast<int>(i) / grid.columns;
    paste(*image, sheet, kGap + column * (grid.cell + kGap) + (grid.cell - image->width) / 2,
          kGap + row * (grid.cell + kGap) + (grid.cell - image->height) / 2);
  }
  core::EncodeOptions as_it_is;
  as_it_is.is_color = false;
  as_it_is.bits = look_.bits;
  const auto bytes = core::encode_image(sheet, png, as_it_is);
  if (!bytes) {
    return bytes.error();
  }
  return std::string(reinterpret_cast<const char*>(bytes->data()), bytes->size());
}

}  // namespace server
