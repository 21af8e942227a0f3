#include "core/scene_io/assimp/read_3mf.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdlib>

#include <zlib.h>

#include "core/scene_io/assimp/words.h"

namespace core {
namespace {

/// A zip archive (APPNOTE.TXT 6.3.3, 4.3.7 and 4.3.12).
class Archive {
 public:
  explicit Archive(std::string_view zip) : zip_(zip) {}

  /// Goes to the next entry; false at the end.
  bool next() {
    at_ = zip_.find("PK\x01\x02", at_ == 0 ? 0 : at_ + 4);
    at_ = at_ == std::string_view::npos ? zip_.size() : at_;
    return at_ < zip_.size();
  }
  std::string_view name() const {
    return zip_.substr(std::min(at_ + 46, zip_.size()), number(at_ + 28, 2));
  }
  /// Returns at most `bytes_max` of the content, up to the first damage.
  std::string content(std::size_t bytes_max) const {
    const std::size_t local = number(at_ + 42, 4);
    const std::size_t begin = local + 30 + number(local + 26, 2) + number(local + 28, 2);
    const std::string_view packed = zip_.substr(std::min(begin, zip_.size()), number(at_ + 20, 4));
    if (number(at_ + 10, 2) == 0) {  // stored
      return std::string(packed.substr(0, bytes_max));
    }
    z_stream stream{};
    stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(packed.data()));
    stream.avail_in = static_cast<uInt>(packed.size());
    if (inflateInit2(&stream, -MAX_WBITS) != Z_OK) {
      return "";
    }
    std::string text;
    for (int status = Z_OK; status == Z_OK && text.size() < bytes_max;) {
      constexpr std::size_t kStep = 65536;
      const std::size_t done = text.size();
      text.resize(std::min(bytes_max, done + kStep));
      stream.next_out = reinterpret_cast<Bytef*>(&text[done]);
      stream.avail_out = static_cast<uInt>(text.size() - done);
      status = inflate(&stream, Z_SYNC_FLUSH);
      text.resize(text.size() - stream.avail_out);
    }
    inflateEnd(&stream);
    return text;
  }

 private:
  std::size_t number(std::size_t at, std::size_t bytes) const {
    std::size_t value = 0;
    for (std::size_t i = bytes; i-- > 0;) {
      value = value << 8U | (at + i < zip_.size() ? static_cast<unsigned char>(zip_[at + i]) : 0U);
    }
    return value;
  }

  std::string_view zip_;
  std::size_t at_ = 0;
};

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

constexpr std::size_t kHead = 65536;  ///< bytes of a model, with its first element

/// Returns at most that many bytes of the entry if it is a model; empty: it is none. A package may
/// give it any name; what does not begin as XML is not unpacked.
std::string model_in(const Archive& entry, std::size_t bytes_max) {
  const bool is_named = small_letters(entry.name()).ends_with(".model");
  const std::string head = entry.content(kHead);
  const std::string_view text =
      std::string_view(head).substr(head.starts_with("\xEF\xBB\xBF") ? 3 : 0);
  const bool is_blank = head.size() == kHead && trimmed(text).empty();
  if (!is_named && !is_blank && !is_wide(head) && !trimmed(text).starts_with('<')) {
    return "";
  }
  std::string out = entry.content(bytes_max);
  return is_named || is_wide(head) || out.find("<model") != std::string::npos ? out : "";
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

}  // namespace

std::string unit_of_3mf(const Bytes& file) {
  std::string text;
  for (Archive archive(text_of(file)); archive.next();) {
    const bool is_main = archive.name() == "3D/3dmodel.model";
    if (is_main || text.empty()) {
      text = model_in(archive, kHead);
    }
    if (is_main) {
      break;
    }
  }
  const std::size_t model = text.find("<model");
  const std::string_view head =
      model == std::string::npos
          ? std::string_view()
          : std::string_view(text).substr(model, text.find('>', model) - model);
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

std::string check_3mf(const Bytes& file, std::vector<std::string>& notes) {
  bool has_model = false;
  bool has_entries = false;
  for (Archive archive(text_of(file)); archive.next();) {
    has_entries = true;
    // Memory is limited by the process.
    const std::string text = model_in(archive, std::string::npos);
    if (text.empty()) {
      continue;
    }
    has_model = true;
    if (is_wide(text)) {
      return "its model is not in UTF-8";
    }
    if (text.find("p:path=") != std::string::npos) {
      return "its objects are in several files (3MF Production Extension), which are not read; "
             "export it as one model, or as STL";
    }
    if (std::string fault = check_transforms(text); !fault.empty()) {
      return fault;
    }
    add_notes(text, notes);
  }
  return has_entries && !has_model ? "it has no 3D model" : "";
}

}  // namespace core
