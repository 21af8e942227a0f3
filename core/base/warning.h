/// Warning: what was read otherwise than a file or a request says, or not at all.
#pragma once

#include <string>
#include <utility>

namespace core {

struct Warning {
  std::string code;     ///< kind, for programs: "clamped", "left_out", ...; "note" without one
  std::string pointer;  ///< JSON pointer into the glTF document; empty: none
  std::string detail;   ///< what was seen, and what was done

  Warning(std::string kind, std::string place, std::string seen)
      : code(std::move(kind)), pointer(std::move(place)), detail(std::move(seen)) {}
  Warning(std::string seen)  // NOLINT(google-explicit-constructor)
      : Warning("note", "", std::move(seen)) {}

  /// Returns one line for people.
  std::string text() const { return pointer.empty() ? detail : pointer + ": " + detail; }

  friend bool operator==(const Warning&, const Warning&) = default;
};

}  // namespace core
