#include "journal/byte_planes.h"

#include <zlib.h>

#include <new>

namespace bki_mapping {

std::string PlaneWriter::packed() const {
  constexpr int kMemoryLevel = 8;  // smaller tables than zlib's largest: they stay in the cache
  constexpr std::size_t kBlockEnd = 16;
  z_stream stream = {};
  // Runs only: on these planes it packs better than zlib's fast levels, and takes less time.
  if (deflateInit2(&stream, 1, Z_DEFLATED, MAX_WBITS, kMemoryLevel, Z_RLE) != Z_OK) throw std::bad_alloc();
  std::string packed(deflateBound(&stream, bytes_.size()) + kBlockEnd * (ends_.size() + 1), '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes_.data()));
  stream.next_out = reinterpret_cast<Bytef*>(packed.data());
  stream.avail_out = static_cast<uInt>(packed.size());
  std::size_t begin = 0;
  for (const std::size_t end : ends_) {  // a block for each plane, since each has its own frequencies
    stream.avail_in = static_cast<uInt>(end - begin);
    deflate(&stream, Z_BLOCK);
    begin = end;
  }
  deflate(&stream, Z_FINISH);
  packed.resize(stream.total_out);
  deflateEnd(&stream);
  return packed;
}

std::optional<std::string> unpackedPlanes(std::string_view packed, std::size_t size) {
  std::string bytes(size, '\0');
  uLongf length = size;
  const int code = uncompress(reinterpret_cast<Bytef*>(bytes.data()), &length,
                              reinterpret_cast<const Bytef*>(packed.data()), packed.size());
  if (code == Z_MEM_ERROR) throw std::bad_alloc();
  if (code != Z_OK || length != size) return std::nullopt;
  return bytes;
}

}  // namespace bki_mapping
