#include "core/scene_io/assimp/read_3mf.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <utility>

#include "core/base/invalid.h"
#include "core/base/text.h"
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

/// Whether this is XML in UTF-16 or UTF-32: it begins with a byte order mark, or its first
/// characters have bytes of 0. Source: Extensible Markup Language 1.0, appendix F.
bool is_wide(std::string_view text) {
  const std::string_view first = text.substr(0, 4);
  return text.starts_with("\xFF\xFE") || text.starts_with("\xFE\xFF") ||
         (first.find('\0') != std::string_view::npos && first.find('<') != std::string_view::npos);
}

/// Whether an entry is a model, by its name or its content: a package may give it any name.
bool is_model(std::string_view name, std::string_view text) {
  return in_lower_case(name).ends_with(".model") || is_wide(text) ||
         text.find("<model") != std::string_view::npos;
}

/// Adds notes of parts that libassimp leaves out. Source of the names: 3MF Materials and Properties
/// Extension, 3 and 4; 3MF Production Extension, 4.2.
void add_notes(std::string_view model, std::vector<std::string>& notes) {
  const auto has = [&](std::string_view text) {
    return model.find(text) != std::string_view::npos;
  };
  if (has("colorgroup") || has("texture2dgroup") || has("compositematerials") ||
      has("multiproperties")) {
    notes.emplace_back("3MF: colours other than those of base materials are left out.");
  }
  for (std::size_t at = model.find("<triangle "); at != std::string_view::npos;
       at = model.find("<triangle ", at + 1)) {
    constexpr std::size_t kLooked = 512;  // bytes: seven attributes
    const std::string_view rest = model.substr(at, kLooked);
    const std::string_view triangle = rest.substr(0, rest.find('>'));
    if (triangle.find(" pid") != std::string_view::npos ||
        triangle.find(" p1") != std::string_view::npos) {
      notes.emplace_back("3MF: each object has one material; those of its triangles are left out.");
      return;
    }
  }
}

/// Returns the unit that a model names in its first element.
std::string unit_of(std::string_view model) {
  model.remove_prefix(std::min(model.find("<model"), model.size()));
  const std::string_view head = model.substr(0, model.find('>'));
  constexpr std::string_view kName = "unit";
  for (std::size_t at = head.find(kName); at != std::string_view::npos;
       at = head.find(kName, at + 1)) {
    const bool is_word = std::isspace(static_cast<unsigned char>(head[at - 1])) != 0;
    const std::string_view value = value_of(head.substr(at + kName.size()));
    if (is_word && !value.empty()) {
      return std::string(value.substr(1));
    }
  }
  return "millimeter";  // the specification's default
}

/// Returns an error text for a model; empty: none.
std::string check_model(std::string_view model) {
  if (is_wide(model)) {
    return "its model is not in UTF-8";
  }
  if (model.find("p:path=") != std::string_view::npos) {
    return "its objects are in several files (3MF Production Extension), which are not read; "
           "export it as one model, or as STL";
  }
  return check_transforms(model);
}

}  // namespace

Result<std::string> check_3mf(const Bytes& file, std::vector<std::string>& notes) {
  const auto entries = read_zip_directory(file, {});
  if (!entries) {
    return entries.error();
  }
  std::string unit;
  for (const ZipEntry& entry : *entries) {
    const auto content = read_zip_entry(file, entry);  // Memory is limited by the process.
    if (!content) {
      return content.error();
    }
    const std::string_view text = text_of(*content);
    if (!is_model(entry.name, text)) {
      continue;
    }
    if (std::string fault = check_model(text); !fault.empty()) {
      return invalid(std::move(fault));
    }
    if (unit.empty() || entry.name == "3D/3dmodel.model") {
      unit = unit_of(text);
    }
    add_notes(text, notes);
  }
  return unit.empty() ? Result<std::string>(invalid("it has no 3D model")) : unit;
}

}  // namespace core
