/// DistributionTable and Distribution2D in SIMD lanes.
#pragma once

#include "core/math/lane_math.h"
#include "core/sampling/distribution.h"

namespace core {

/// One table per lane: that of lane k begins at [cdf_first[k]] and [guide_first[k]] of the arrays.
template <std::size_t N>
struct TableLanes {
  DistributionTable table;
  Ints<N> cdf_first{0};
  Ints<N> guide_first{0};

  struct Sample {
    Floats<N> x;
    Floats<N> pdf_unit;
    Ints<N> cell;
  };
  Floats<N> cdf_at(Ints<N> cell) const { return gather(table.cdf, cdf_first + cell); }
  Floats<N> prob_cell(Ints<N> cell) const { return cdf_at(cell + Ints<N>(1)) - cdf_at(cell); }
  /// As DistributionTable::sample() with a guide.
  Sample sample(Floats<N> u) const {
    const Floats<N> n = length();
    const Ints<N> one(1);
    const Ints<N> cell = cell_of(u);
    const Floats<N> width = prob_cell(cell);
    const Floats<N> within =
        select(width > Floats<N>(0), (u - cdf_at(cell)) / width, Floats<N>(0.5F));
    Floats<N> x = min((to_floats(cell) + within) / n, Floats<N>(kOneMinusEpsilon));
    for (Mask<N> over = cell < truncated(x * n); over.any(); over = cell < truncated(x * n)) {
      x = select(over, floats_of(bits_of(x) - one), x);
    }
    return {x, width * n, cell};
  }
  /// As DistributionTable::cell_of().
  Ints<N> cell_of(Floats<N> u) const {
    const auto* guide = reinterpret_cast<const std::int32_t*>(table.guide);
    const Ints<N> one(1);
    const Ints<N> last(table.size - 1);
    const Ints<N> last_guide(table.guide_size - 1);
    const auto guide_at = [&](Ints<N> i) { return gather(guide, guide_first + i); };
    const Ints<N> start = truncated(u * Floats<N>(static_cast<float>(table.guide_size)));
    Ints<N> cell = guide_at(select(last_guide < start, last_guide, start));
    const Mask<N> has_next = start < last_guide;
    Ints<N> most = select(has_next, guide_at(select(has_next, start + one, last_guide)), last);
    for (auto open = cell < most; open.any(); open = cell < most) {
      const Ints<N> middle = (cell + most + one) >> 1;
      const Mask<N> is_before = cdf_at(middle) <= u;
      cell = select(open & is_before, middle, cell);
      most = select(open & ~is_before, middle - one, most);
    }
    const auto step = [&](Mask<N> wrong, Ints<N> by) {  // i was rounded
      cell = select(wrong, cell + by, cell);
      return wrong.any();
    };
    while (step((Ints<N>(0) < cell) & (cdf_at(cell) > u), Ints<N>(-1))) {
    }
    while (step((cell < last) & (cdf_at(cell + one) <= u), one)) {
    }
    return cell;
  }
  /// As DistributionTable::pdf_unit().
  Floats<N> pdf_unit(Floats<N> x) const { return prob_cell(cell_at(x)) * length(); }
  /// Returns the cell that contains x.
  Ints<N> cell_at(Floats<N> x) const {
    const Ints<N> last(table.size - 1);
    const Ints<N> cell = truncated(max(x, Floats<N>(0)) * length());
    return select(last < cell, last, cell);
  }

 private:
  Floats<N> length() const { return Floats<N>(static_cast<float>(table.size)); }
};

/// Returns where the table's density puts u.
inline float position_in(const DistributionTable& table, float u) noexcept {
  return table.sample(u).x;
}
template <std::size_t N>
Floats<N> position_in(const DistributionTable& table, Floats<N> u) {
  return TableLanes<N>{table}.sample(u).x;
}

template <std::size_t N>
struct SquareSample {
  Vec2s<N> uv;
  Floats<N> pdf_unit;
  Ints<N> column;
  Ints<N> row;
};

namespace distribution_detail {

template <std::size_t N>
TableLanes<N> rows_of(const Distribution2D& d, Ints<N> row) {
  const DistributionTable first = d.row(0);
  return {first, row * Ints<N>(first.size + 1), row * Ints<N>(first.guide_size)};
}

}  // namespace distribution_detail

/// As Distribution2D::sample().
template <std::size_t N>
SquareSample<N> sample_square(const Distribution2D& d, Vec2s<N> u) {
  const auto y = TableLanes<N>{d.marginal()}.sample(u.y);
  const auto x = distribution_detail::rows_of(d, y.cell).sample(u.x);
  return {{x.x, y.x}, y.pdf_unit * x.pdf_unit, x.cell, y.cell};
}

/// As Distribution2D::pdf_unit().
template <std::size_t N>
Floats<N> pdf_square(const Distribution2D& d, Vec2s<N> uv) {
  const TableLanes<N> marginal{d.marginal()};
  return marginal.pdf_unit(uv.y) *
         distribution_detail::rows_of(d, marginal.cell_at(uv.y)).pdf_unit(uv.x);
}

}  // namespace core
