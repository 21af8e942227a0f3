/// WeightedReservoir: selects one item of a stream with probability proportional to its weight,
/// with one uniform number for the whole stream.
///
/// Item i replaces the selected one with probability p = w_i / (w_1 + ... + w_i). The part of u
/// below or above p is rescaled to [0,1) for the next item. Sources: Chao, A general purpose
/// unequal probability sampling plan, 1982; the reuse of u is Shirley's.
#pragma once

namespace core {

template <typename Item>
class WeightedReservoir {
 public:
  /// u in [0,1).
  explicit WeightedReservoir(double u) noexcept : u_(u) {}

  /// weight: finite; items of weight 0 or less are never selected.
  void add(const Item& item, double weight) noexcept {
    if (!(weight > 0)) {
      return;
    }
    sum_ += weight;
    const double p = weight / sum_;
    if (u_ < p || p >= 1) {  // 1 by rounding: earlier weights vanish in the sum
      u_ = u_ / p;
      item_ = item;
      weight_ = weight;
    } else {
      u_ = (u_ - p) / (1 - p);
    }
  }

  bool empty() const noexcept { return !(weight_ > 0); }
  const Item& item() const noexcept { return item_; }  ///< Pre: !empty()
  double weight() const noexcept { return weight_; }   ///< of item()
  double sum() const noexcept { return sum_; }         ///< of all weights
  /// Returns the mean weight of `count` items over that of item(), which it stands for.
  float scale(int count) const noexcept {
    return static_cast<float>(sum_ / (static_cast<double>(count) * weight_));
  }

 private:
  Item item_{};
  double u_;
  double weight_ = 0;
  double sum_ = 0;
};

}  // namespace core
