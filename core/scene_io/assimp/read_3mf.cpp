#include "core/scene_io/assimp/read_3mf.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <utility>

#include "core/base/invalid.h"
#include "core/base/zip_reader.h"
#include "core/scene_io/assimp/words.h"

namespace core {
namespace {

bool is_finite_number(std::string_view word) {
  const std::string text(word);
  char* end = nullptr;
  const float value = std::strtof(text.c_str(), &end);
  return end == text.c_str() + text.size() && std::isfinite(value);
}

/// Returns the value of the attribute after whose name the text begins; empty: there is none.
std::string_view value_of(std::string_view text) {
  text = trimmed(text);
  if (!text.starts_with('=')) {
    return {};
  }
  text = trimmed(text.substr(1));
  const bool is_quoted = text.starts_with('"') || text.starts_with('\'');
  return is_quoted ? text.substr(0, text.find(text.front(), 1)) : std::string_view();
}

/// Returns an error text for a model; empty: none.
std::string check_transforms(std::string_view model) {
  constexpr std::string_view kName = "transform";
  constexpr std::size_t kNumbers = 12;
  constexpr std::size_t kValueMost = 4096;  // bytes that are looked at; libassimp reads all
  for (std::size_t at = model.find(kName); at != std::string_view::npos;
       at = model.find(kName, at + kName.size())) {
    const std::string_view value = value_of(model.substr(at + kName.size(), kValueMost));
    if (value.empty()) {
      continue;
    }
    const auto words = words_of(value.substr(1));
    if (words.size() != kNumbers || !std::all_of(words.begin(), words.end(), is_finite_number)) {
      return "the transform \"" + std::string(value.substr(1, 200)) + "\" is not " +
             std::to_string(kNumbers) + " numbers";
    }
  }
  return "";
}

/// Returns the unit that a model names in its first element.
std::string unit_of(std::string_view model) {
  model.remove_prefix(std::min(model.find("<model"), model.size()));
  const std::string_view head = model.substr(0, model.find('>'));
  const std::size_t unit = head.find("unit=");
  if (unit == std::string_view::npos || unit + 6 > head.size()) {
    return "millimeter";  // the specification's default
  }
  const std::size_t end = head.find(head[unit + 5], unit + 6);
  return std::string(end == std::string_view::npos ? "" : head.substr(unit + 6, end - unit - 6));
}

}  // namespace

Result<std::string> check_3mf(const Bytes& file) {
  const auto entries = read_zip_directory(file, {});
  if (!entries) {
    return entries.error();
  }
  std::string unit = unit_of("");
  for (const ZipEntry& entry : *entries) {
    if (!entry.name.ends_with(".model")) {
      continue;
    }
    const auto model = read_zip_entry(file, entry);  // Memory is limited by the process.
    if (!model) {
      return model.error();
    }
    if (std::string fault = check_transforms(text_of(*model)); !fault.empty()) {
      return invalid(std::move(fault));
    }
    if (entry.name == "3D/3dmodel.model") {
      unit = unit_of(text_of(*model));
    }
  }
  return unit;
}

}  // namespace core
