#include "core/scene_io/gltf_repairs.h"

#include <algorithm>
#include <cstddef>
#include <map>
#include <utility>

namespace core {
namespace {

constexpr std::size_t kSameMax = 10;
constexpr std::size_t kAllMax = 100;
/// Before shorten(): bounds the memory for files with a fault in every element.
constexpr std::size_t kHeldMax = 100'000;

}  // namespace

Status GltfRepairs::mended(std::string code, std::string pointer, std::string fault,
                           const std::string& remedy) {
  if (is_strict_) {
    return Error{ErrorCode::kInvalidArgument, std::move(fault), std::move(pointer)};
  }
  note(std::move(code), std::move(pointer), fault + "; " + remedy);
  return ok_status();
}

void GltfRepairs::note(std::string code, std::string pointer, std::string detail) {
  if (warnings_.size() < kHeldMax) {
    warnings_.emplace_back(std::move(code), std::move(pointer), std::move(detail));
  }
}

void shorten(std::vector<Warning>& warnings) {
  struct Count {
    std::size_t kept = 0;
    std::size_t left = 0;
  };
  std::map<std::string, Count> counts;
  std::vector<Warning> kept;
  for (Warning& warning : warnings) {
    Count& count = counts[warning.code];
    if (count.kept < kSameMax && kept.size() < kAllMax) {
      ++count.kept;
      kept.push_back(std::move(warning));
    } else {
      ++count.left;
    }
  }
  for (const auto& [code, count] : counts) {
    if (count.left > 0) {
      kept.emplace_back(code, "",
                        "and " + std::to_string(count.left) + " more of this kind (" + code + ")");
    }
  }
  warnings = std::move(kept);
}

}  // namespace core
