#include "core/image_io/etc1s.h"

#include <algorithm>
#include <utility>

namespace core {
namespace {

/// Khronos Data Format Specification 1.3, table 89; by intensity, then selector.
constexpr std::array<std::array<int, 4>, 8> kModifiers = {{{-8, -2, 2, 8},
                                                           {-17, -5, 5, 17},
                                                           {-29, -9, 9, 29},
                                                           {-42, -13, 13, 42},
                                                           {-60, -18, 18, 60},
                                                           {-80, -24, 24, 80},
                                                           {-106, -33, 33, 106},
                                                           {-183, -47, 47, 183}}};

/// Constants of the specification's decoder.
constexpr std::uint32_t kRepeatPrediction = 256;
constexpr std::uint32_t kRepeatLeast = 3;
constexpr std::uint32_t kRunLeast = 3;
constexpr std::uint32_t kLongRun = 63;

/// Reads a number in chunks of `bits`, whose highest bit says that another chunk follows.
std::uint32_t read_chunks(BitReader& bits, std::uint32_t chunk) {
  std::uint32_t value = 0;
  for (std::uint32_t shift = 0; shift < 32; shift += chunk) {
    const std::uint32_t part = bits.read(chunk + 1);
    value |= (part & ((1U << chunk) - 1U)) << shift;
    if ((part >> chunk) == 0) {
      break;
    }
  }
  return value;
}

bool read_table(BitReader& bits, BasisHuffman& to) {
  auto table = BasisHuffman::read(bits);
  if (!table) {
    return false;
  }
  to = *std::move(table);
  return true;
}

/// The most recent selectors; those that are used move towards the front.
class History {
 public:
  explicit History(std::size_t size) : values_(size), next_(size / 2) {}

  void add(std::uint32_t selector) {
    if (values_.empty()) {
      return;
    }
    values_[next_++] = selector;
    next_ = next_ == values_.size() ? values_.size() / 2 : next_;
  }
  std::optional<std::uint32_t> use(std::size_t index) {
    if (index >= values_.size()) {
      return std::nullopt;
    }
    const std::uint32_t selector = values_[index];
    std::swap(values_[index / 2], values_[index]);
    return selector;
  }

 private:
  std::vector<std::uint32_t> values_;
  std::size_t next_;
};

}  // namespace

/// The state of a slice's decoder: the codebook indices of each block.
class Etc1sCodebooks::Slice {
 public:
  Slice(const Etc1sCodebooks& books, std::span<const std::byte> data, std::size_t blocks_x)
      : books_(books),
        bits_(data),
        history_(books.history_size_),
        above_(blocks_x),
        below_bits_((blocks_x + 1) / 2) {}

  struct Block {
    std::size_t endpoint = 0;
    std::size_t selector = 0;
  };
  /// Returns blocks row by row; empty for malformed data.
  std::optional<Block> next(std::size_t x, std::size_t y) {
    if (!read_prediction(x, y)) {
      return std::nullopt;
    }
    const std::uint32_t prediction = prediction_bits_ & 3U;
    prediction_bits_ >>= 2U;
    const std::uint32_t corner = above_left_;
    above_left_ = above_[x];
    if (!predict_endpoint(prediction, corner, x, y)) {
      return std::nullopt;
    }
    above_[x] = endpoint_;
    const auto selector = read_selector();
    if (!selector || endpoint_ >= books_.endpoints_.size() ||
        *selector >= books_.selectors_.size() || bits_.is_past_end()) {
      return std::nullopt;
    }
    return Block{endpoint_, *selector};
  }

 private:
  /// Two bits for each block of 2 x 2 blocks are stored with the first of them.
  bool read_prediction(std::size_t x, std::size_t y) {
    if (x % 2 != 0) {
      return true;
    }
    if (y % 2 != 0) {
      prediction_bits_ = below_bits_[x / 2];
      return true;
    }
    if (repeats_ > 0) {
      --repeats_;
      prediction_bits_ = last_prediction_;
    } else {
      const auto symbol = books_.endpoint_prediction_.decode(bits_);
      if (!symbol || *symbol > kRepeatPrediction) {
        return false;
      }
      if (*symbol == kRepeatPrediction) {
        repeats_ = read_chunks(bits_, 4) + kRepeatLeast - 1;
      } else {
        last_prediction_ = *symbol;
      }
      prediction_bits_ = last_prediction_;
    }
    below_bits_[x / 2] = static_cast<std::uint8_t>(prediction_bits_ >> 4U);
    return true;
  }

  bool predict_endpoint(std::uint32_t prediction, std::uint32_t corner, std::size_t x,
                        std::size_t y) {
    switch (prediction) {
      case 0:
        return x > 0;  // predicts the left block, which is already there
      case 1:
        endpoint_ = above_[x];
        return y > 0;
      case 2:
        endpoint_ = corner;
        return x > 0 && y > 0;
      default:
        break;
    }
    const auto delta = books_.endpoint_delta_.decode(bits_);
    if (!delta) {
      return false;
    }
    endpoint_ += *delta;
    const auto count = static_cast<std::uint32_t>(books_.endpoints_.size());
    endpoint_ -= endpoint_ >= count ? count : 0;
    return endpoint_ < count;
  }

  std::optional<std::uint32_t> read_selector() {
    const auto count = static_cast<std::uint32_t>(books_.selectors_.size());
    if (run_ > 0) {
      --run_;
      return history_.use(0);
    }
    const auto symbol = books_.selector_.decode(bits_);
    if (!symbol) {
      return std::nullopt;
    }
    if (*symbol == count + books_.history_size_) {
      const auto run = books_.history_run_.decode(bits_);
      if (!run) {
        return std::nullopt;
      }
      run_ = (*run == kLongRun ? read_chunks(bits_, 7) : *run) + kRunLeast - 1;
      return history_.use(0);
    }
    if (*symbol >= count) {
      return history_.use(*symbol - count);
    }
    history_.add(*symbol);
    return symbol;
  }

  const Etc1sCodebooks& books_;
  BitReader bits_;
  History history_;
  std::vector<std::uint32_t> above_;  // endpoints: of this row up to the current block, then of the
                                      // row above
  std::vector<std::uint8_t> below_bits_;
  std::uint32_t above_left_ = 0;
  std::uint32_t prediction_bits_ = 0;
  std::uint32_t last_prediction_ = 0;
  std::uint32_t repeats_ = 0;
  std::uint32_t endpoint_ = 0;
  std::uint32_t run_ = 0;
};

std::optional<Etc1sCodebooks> Etc1sCodebooks::read(const Sections& sections) {
  Etc1sCodebooks books;
  if (sections.endpoint_count == 0 || sections.selector_count == 0 ||
      !books.read_endpoints(sections.endpoints, sections.endpoint_count) ||
      !books.read_selectors(sections.selectors, sections.selector_count) ||
      !books.read_tables(sections.tables)) {
    return std::nullopt;
  }
  return books;
}

bool Etc1sCodebooks::read_endpoints(std::span<const std::byte> data, std::uint32_t count) {
  BitReader bits(data);
  std::array<BasisHuffman, 3> color_delta;
  BasisHuffman intensity_delta;
  for (BasisHuffman& table : color_delta) {
    if (!read_table(bits, table)) {
      return false;
    }
  }
  if (!read_table(bits, intensity_delta)) {
    return false;
  }
  const std::size_t channels = bits.read(1) == 1 ? 1 : 3;
  Endpoint last{{16, 16, 16}, 0};
  endpoints_.reserve(count);
  for (std::uint32_t i = 0; i < count; ++i) {
    const auto intensity = intensity_delta.decode(bits);
    if (!intensity) {
      return false;
    }
    last.intensity = static_cast<std::uint8_t>((last.intensity + *intensity) & 7U);
    for (std::size_t c = 0; c < channels; ++c) {
      const std::uint32_t before = last.color[c];
      const auto delta = color_delta[before < 10 ? 0 : before < 22 ? 1 : 2].decode(bits);
      if (!delta) {
        return false;
      }
      last.color[c] = static_cast<std::uint8_t>((before + *delta) & 31U);
    }
    if (channels == 1) {
      last.color[1] = last.color[2] = last.color[0];
    }
    if (bits.is_past_end()) {
      return false;
    }
    endpoints_.push_back(last);
  }
  return true;
}

bool Etc1sCodebooks::read_selectors(std::span<const std::byte> data, std::uint32_t count) {
  BitReader bits(data);
  if (bits.read(2) != 0) {
    return false;
  }
  const bool is_raw = bits.read(1) == 1;
  BasisHuffman delta;
  if (!is_raw && !read_table(bits, delta)) {
    return false;
  }
  selectors_.reserve(count);
  for (std::uint32_t i = 0; i < count; ++i) {
    Selector selector{};
    for (std::size_t row = 0; row < selector.size(); ++row) {
      if (is_raw || i == 0) {
        selector[row] = static_cast<std::uint8_t>(bits.read(8));
        continue;
      }
      const auto change = delta.decode(bits);
      if (!change) {
        return false;
      }
      selector[row] = static_cast<std::uint8_t>((*change ^ selectors_.back()[row]) & 255U);
    }
    if (bits.is_past_end()) {
      return false;
    }
    selectors_.push_back(selector);
  }
  return true;
}

bool Etc1sCodebooks::read_tables(std::span<const std::byte> data) {
  BitReader bits(data);
  if (!read_table(bits, endpoint_prediction_) || !read_table(bits, endpoint_delta_) ||
      !read_table(bits, selector_) || !read_table(bits, history_run_)) {
    return false;
  }
  history_size_ = bits.read(13);
  return !bits.is_past_end();
}

void Etc1sCodebooks::write_block(const Endpoint& endpoint, const Selector& selector, std::size_t x,
                                 std::size_t y, const Target& target) const {
  std::array<std::array<std::byte, 3>, 4> colors{};
  for (std::size_t s = 0; s < colors.size(); ++s) {
    for (std::size_t c = 0; c < 3; ++c) {
      const int base = endpoint.color[c] * 8 + endpoint.color[c] / 4;
      const int value = base + kModifiers[endpoint.intensity][s];
      colors[s][c] = static_cast<std::byte>(std::clamp(value, 0, 255));
    }
  }
  const std::size_t rows = std::min<std::size_t>(4, target.height - y);
  const std::size_t columns = std::min<std::size_t>(4, target.width - x);
  for (std::size_t row = 0; row < rows; ++row) {
    for (std::size_t column = 0; column < columns; ++column) {
      const auto& color = colors[std::uint32_t{selector[row]} >> (2 * column) & 3U];
      const std::size_t texel = (y + row) * target.width + x + column;
      for (std::size_t c = 0; c < target.count; ++c) {
        target.pixels[texel * target.channels + target.first + c] =
            color[target.count == 1 ? 1 : c];
      }
    }
  }
}

bool Etc1sCodebooks::decode_slice(std::span<const std::byte> slice, const Target& target) const {
  Slice decoder(*this, slice, (target.width + 3) / 4);
  for (std::size_t y = 0; y < target.height; y += 4) {
    for (std::size_t x = 0; x < target.width; x += 4) {
      const auto block = decoder.next(x / 4, y / 4);
      if (!block) {
        return false;
      }
      write_block(endpoints_[block->endpoint], selectors_[block->selector], x, y, target);
    }
  }
  return true;
}

}  // namespace core
