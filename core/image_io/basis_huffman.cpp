#include "core/image_io/basis_huffman.h"

#include <algorithm>
#include <array>

namespace core {
namespace {

constexpr std::size_t kLengthMax = 16;
constexpr std::size_t kLengthCodes = 21;
constexpr std::array<std::uint8_t, kLengthCodes> kLengthOrder = {
    17, 18, 19, 20, 0, 8, 7, 9, 6, 10, 5, 11, 4, 12, 3, 13, 2, 14, 1, 15, 16};

/// Symbols 17 to 20: bits of the repeat count that follows, and the number added to it.
struct Run {
  std::uint32_t bits;
  std::uint32_t least;
  bool repeats;  ///< repeats the previous length; else zeros
};
constexpr std::array<Run, 4> kRuns = {Run{3, 3, false}, Run{7, 11, false}, Run{2, 3, true},
                                      Run{7, 7, true}};

std::uint32_t reversed(std::uint32_t code, std::uint32_t length) {
  std::uint32_t out = 0;
  for (std::uint32_t i = 0; i < length; ++i) {
    out |= ((code >> i) & 1U) << (length - 1 - i);
  }
  return out;
}

}  // namespace

std::optional<BasisHuffman> BasisHuffman::from_lengths(const std::vector<std::uint8_t>& lengths) {
  BasisHuffman table;
  std::array<std::uint32_t, kLengthMax + 1> count{};
  for (const std::uint8_t length : lengths) {
    table.bits_max_ = std::max<std::uint32_t>(table.bits_max_, length);
    ++count[length];
  }
  if (table.bits_max_ == 0) {
    return table;
  }
  // RFC 1951, 3.2.2.
  count[0] = 0;
  std::array<std::uint32_t, kLengthMax + 2> next{};
  for (std::size_t length = 1; length <= kLengthMax; ++length) {
    next[length] = (next[length - 1] + count[length - 1]) << 1U;
    if (next[length] + count[length] > (1U << length)) {
      return std::nullopt;
    }
  }
  table.entries_.resize(std::size_t{1} << table.bits_max_);
  for (std::size_t symbol = 0; symbol < lengths.size(); ++symbol) {
    const std::uint32_t length = lengths[symbol];
    if (length == 0) {
      continue;
    }
    const std::size_t step = std::size_t{1} << length;
    for (std::size_t i = reversed(next[length], length); i < table.entries_.size(); i += step) {
      table.entries_[i] = {static_cast<std::uint16_t>(symbol), static_cast<std::uint16_t>(length)};
    }
    ++next[length];
  }
  return table;
}

std::optional<BasisHuffman> BasisHuffman::read(BitReader& bits) {
  const std::size_t symbols = bits.read(14);
  if (symbols == 0) {
    return BasisHuffman();
  }
  const std::size_t given = bits.read(5);
  if (given < 1 || given > kLengthCodes) {
    return std::nullopt;
  }
  std::vector<std::uint8_t> code_lengths(kLengthCodes);
  for (std::size_t i = 0; i < given; ++i) {
    code_lengths[kLengthOrder[i]] = static_cast<std::uint8_t>(bits.read(3));
  }
  const auto codes = from_lengths(code_lengths);
  if (!codes) {
    return std::nullopt;
  }
  std::vector<std::uint8_t> lengths;
  while (lengths.size() < symbols) {
    const auto code = codes->decode(bits);
    if (!code || bits.is_past_end()) {
      return std::nullopt;
    }
    if (*code <= kLengthMax) {
      lengths.push_back(static_cast<std::uint8_t>(*code));
      continue;
    }
    const Run& run = kRuns[*code - kLengthMax - 1];
    const std::size_t count = run.least + bits.read(run.bits);
    if ((run.repeats && (lengths.empty() || lengths.back() == 0)) ||
        lengths.size() + count > symbols) {
      return std::nullopt;
    }
    lengths.resize(lengths.size() + count, run.repeats ? lengths.back() : std::uint8_t{0});
  }
  return from_lengths(lengths);
}

std::optional<std::uint32_t> BasisHuffman::decode(BitReader& bits) const noexcept {
  if (bits_max_ == 0) {
    return std::nullopt;
  }
  const Entry& entry = entries_[bits.peek(bits_max_)];
  if (entry.length == 0) {
    return std::nullopt;
  }
  bits.skip(entry.length);
  return entry.symbol;
}

}  // namespace core
