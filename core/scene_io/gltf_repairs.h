/// GltfRepairs: faults of a file that do not keep it from being drawn, and what was done about
/// each.
///
/// A fault is mended if the picture that remains is the one that the file means: a value goes to
/// the nearest one of its range, a direction to unit length, and a part is left out if nothing
/// drawn needs it. Faults that leave no picture without guessing are errors at once.
#pragma once

#include <string>
#include <vector>

#include "core/base/result.h"
#include "core/base/warning.h"

namespace core {

class GltfRepairs {
 public:
  /// is_strict: every fault is an error, as the glTF specification allows.
  explicit GltfRepairs(bool is_strict) : is_strict_(is_strict) {}

  bool is_strict() const noexcept { return is_strict_; }

  /// Notes a fault at `pointer` that was mended. `fault`: what was seen, and what is allowed;
  /// `remedy`: what counts instead. Strict: returns kInvalidArgument with `fault`.
  Status mended(std::string code, std::string pointer, std::string fault,
                const std::string& remedy);
  /// Notes what a reader may wish to know, but the specification allows.
  void note(std::string code, std::string pointer, std::string detail);

  std::vector<Warning> take() { return std::move(warnings_); }

 private:
  bool is_strict_;
  std::vector<Warning> warnings_;
};

/// Keeps at most ten warnings of each code and a hundred in all; further ones are counted in a last
/// one of their code.
void shorten(std::vector<Warning>& warnings);

}  // namespace core
