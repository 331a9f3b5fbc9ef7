#include "beams/split_directions.h"

#include "beams/beam_cells.h"
#include "beams/raster/line_kernels.h"
#include "parallel/chunks.h"

namespace bki_mapping {

void SplitDirections::set(const Beams& beams, double resolution, const LineKernels& kernels,
                          ThreadPool& pool) {
  const std::size_t count = beams.ends.size();
  for (std::vector<float>& part : parts_) part.resize(count + kBeamPadding, 0.0f);
  const Chunks chunks(count);
  pool.forEach(chunks.count(), [&](std::size_t c, std::size_t) {
    const std::size_t begin = chunks.begin(c);
    const auto part = [&](std::size_t n) { return parts_[n].data() + begin; };
    kernels.set_up_directions(beams.ends.data() + begin, chunks.end(c) - begin, resolution,
                              {part(0), part(1), part(2), part(3), part(4), part(5), part(6)});
  });
}

}  // namespace bki_mapping
