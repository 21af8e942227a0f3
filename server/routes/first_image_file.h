/// Files of first images: the encoded images that a job is opened with, stored beside its film, so
/// that the first requests for them after a restart do not read the film. A damaged or missing file
/// costs time only: the images are encoded from the film again.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.h"
#include "server/pictures/picture.h"

namespace server {

struct FirstImage {
  std::string key;  ///< Names film and request; without a space.
  EncodedPicture picture;
};

/// End of the name of a file that is being written; a process that is killed leaves it behind.
inline constexpr std::string_view kPartEnd = ".part";

/// Returns the content of such a file.
std::string first_images_text(const std::vector<FirstImage>& images);
/// Replaces the file. Not synced. Errors: of files.h.
core::Status write_first_images(const std::string& path, std::string_view text);
/// Errors: kNotFound when there is no file or no such image in it; kInternal when it is damaged.
core::Result<EncodedPicture> read_first_image(const std::string& path, std::string_view key);
/// Verifies all images of the file. Errors: of read_first_image().
core::Status check_first_images(const std::string& path);

}  // namespace server
