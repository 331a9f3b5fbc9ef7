#include "beams/raster/line_setup.h"

#include "beams/beam_cells.h"
#include "beams/raster/line_kernels.h"
#include "parallel/chunks.h"

namespace bki_mapping {

void LineSetups::set(const Beams& beams, double resolution, double length, const LineKernels& kernels,
                     ThreadPool& pool) {
  const std::size_t count = beams.ends.size(), padded = count + kBeamPadding;
  axis_.resize(padded, 0);
  for (auto* each : {&slope_side_, &slope_height_, &end_, &shear_}) each->resize(padded, 0.0f);
  lines_.resize(count);
  const auto reach = static_cast<float>(length / resolution);
  const Chunks chunks(count);
  pool.forEach(chunks.count(), [&](std::size_t c, std::size_t) {
    const std::size_t begin = chunks.begin(c);
    kernels.set_up_lines(beams.ends.data() + begin, chunks.end(c) - begin, resolution, reach,
                         {axis_.data() + begin, slope_side_.data() + begin, slope_height_.data() + begin,
                          end_.data() + begin, shear_.data() + begin, lines_.data() + begin});
  });
}

void LineSetups::setEvery(std::size_t one_of, const LineSetups& others, std::size_t all) {
  const std::size_t count = (all + one_of - 1) / one_of, padded = count + kBeamPadding;
  axis_.resize(padded, 0);
  for (auto* each : {&slope_side_, &slope_height_, &end_, &shear_}) each->resize(padded, 0.0f);
  lines_.resize(count);
  for (std::size_t to = 0, from = 0; to < count; ++to, from += one_of) {
    axis_[to] = others.axis_[from];
    slope_side_[to] = others.slope_side_[from];
    slope_height_[to] = others.slope_height_[from];
    end_[to] = others.end_[from];
    shear_[to] = others.shear_[from];
    lines_[to] = others.lines_[from];
  }
}

}  // namespace bki_mapping
