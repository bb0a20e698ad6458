// Builds the block by which pvs_find() finds the root cells that hold a point: boxes around the
// roots in Morton order, and around every 16 of them, every 256, and so on up to one.
#pragma once

#include <cstdint>
#include <vector>

#include "common/cells/cell.hpp"
#include "common/pvs/store_bytes.hpp"

namespace pvsfarm {

class LocateBuilder {
 public:
  void add(const Cell& root, std::uint32_t node);
  ByteWriter take() const;

 private:
  struct FloatBox {
    float lo[3], hi[3];
  };
  struct Root {  // 28 bytes: the writer holds them all
    FloatBox box;
    std::uint32_t node;
  };
  static void put(ByteWriter& out, const std::vector<FloatBox>& level);
  static std::vector<FloatBox> level_above(const std::vector<FloatBox>& level);
  std::vector<std::uint32_t> morton_order() const;

  std::vector<Root> roots_;
};

}  // namespace pvsfarm
