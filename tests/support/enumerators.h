/// The enumerators of an enum class whose values count up from 0, by their names in the compiler's
/// text: a new one is tested without a change of the tests.
#pragma once

#include <string_view>
#include <vector>

namespace test_support {

/// Whether a value has a name. GCC and clang print one without as "(core::StopReason)12".
template <auto kValue>
constexpr bool is_enumerator() {
  constexpr std::string_view kText = __PRETTY_FUNCTION__;
  constexpr std::string_view kBefore = "kValue = ";
  const auto at = kText.find(kBefore);
  return at != std::string_view::npos && kText[at + kBefore.size()] != '(';
}

template <typename Enum, int kFrom = 0>
std::vector<Enum> enumerators() {
  if constexpr (is_enumerator<static_cast<Enum>(kFrom)>()) {
    std::vector<Enum> all = enumerators<Enum, kFrom + 1>();
    all.insert(all.begin(), static_cast<Enum>(kFrom));
    return all;
  }
  return {};
}

}  // namespace test_support
