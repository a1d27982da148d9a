// A tree's topology and then its leaves' values, both depth first:
//   int32 1; value background; uint32 number of root tiles, root children; each tile: int32[3]
//   origin, value, uint8 active; each child: int32[3] origin, node
//   node    child mask, active mask (a bit for each slot), values; the children, or for those of
//           the lowest level, leaves, their active mask
//   leaf    active mask once more, values
#include "worker/ingest/formats/vdb_tree.h"

#include <array>
#include <cmath>
#include <cstdlib>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "worker/ingest/formats/byte_reader.h"
#include "worker/ingest/formats/vdb_values.h"

namespace liquidblend::ingest {
namespace {

using openvdb::Coord;

// A node of 2^kLog2 slots a side; a slot has 2^kSlotLog2 voxels a side.
template <int log2, int slot_log2>
struct Level {
  static constexpr int kLog2 = log2;
  static constexpr int kSlotLog2 = slot_log2;
  static constexpr size_t kNumSlots = size_t{1} << (3 * log2);
  using Mask = std::array<uint64_t, kNumSlots / 64>;
};
using Upper = Level<5, 7>;
using Lower = Level<4, 3>;
using Leaf = Level<3, 0>;
constexpr int kRootLog2 = 12;

template <typename LevelType>
Coord SlotOrigin(const Coord& origin, size_t slot) {
  const auto index = static_cast<int32_t>(slot);
  constexpr int32_t kMask = (1 << LevelType::kLog2) - 1;
  return origin + Coord((index >> 2 * LevelType::kLog2) << LevelType::kSlotLog2,
                        (index >> LevelType::kLog2 & kMask) << LevelType::kSlotLog2,
                        (index & kMask) << LevelType::kSlotLog2);
}

std::string FormatCoord(const Coord& c) {
  return absl::StrCat("(", c.x(), ", ", c.y(), ", ", c.z(), ")");
}

// One float, or three.
template <typename Value>
constexpr int kNumComponents = static_cast<int>(sizeof(Value) / sizeof(float));
template <typename Value>
Value ToValue(const float* components) {
  if constexpr (kNumComponents<Value> == 1) {
    return *components;
  } else {
    return Value(components[0], components[1], components[2]);
  }
}

template <typename Tree>
class TreeReader {
 public:
  using Value = typename Tree::ValueType;
  using LeafNode = typename Tree::LeafNodeType;

  explicit TreeReader(const VdbGrid& grid) : reader_(grid.tree) {
    format_.num_components = kSize;
    format_.is_half = grid.is_half;
    format_.compression = grid.compression;
  }

  absl::StatusOr<typename Tree::Ptr> Read() {
    int32_t num_buffers = 0;
    LB_RETURN_IF_ERROR(reader_.Read(num_buffers));
    if (num_buffers != 1) {
      return absl::InvalidArgumentError(absl::StrCat("the tree has ", num_buffers, " buffers"));
    }
    LB_RETURN_IF_ERROR(ReadRoot());
    for (LeafNode* const leaf : leaves_) LB_RETURN_IF_ERROR(ReadLeafValues(*leaf));
    return tree_;
  }

 private:
  static constexpr int kSize = kNumComponents<Value>;

  absl::Status ReadRoot() {
    LB_RETURN_IF_ERROR(ReadFloats(format_.background));
    tree_ = std::make_shared<Tree>(ToValue<Value>(format_.background));
    uint32_t num_tiles = 0;
    uint32_t num_children = 0;
    LB_RETURN_IF_ERROR(reader_.Read(num_tiles));
    LB_RETURN_IF_ERROR(reader_.Read(num_children));
    for (uint32_t i = 0; i < num_tiles; ++i) {
      LB_ASSIGN_OR_RETURN(const Coord origin, ReadRootOrigin());
      float value[3];
      uint8_t is_active = 0;
      LB_RETURN_IF_ERROR(ReadFloats(value));
      LB_RETURN_IF_ERROR(reader_.Read(is_active));
      tree_->addTile(/*level=*/3, origin, ToValue<Value>(value), is_active != 0);
    }
    for (uint32_t i = 0; i < num_children; ++i) {
      LB_ASSIGN_OR_RETURN(const Coord origin, ReadRootOrigin());
      LB_RETURN_IF_ERROR(ReadNode<Upper>(origin));
    }
    return absl::OkStatus();
  }

  absl::StatusOr<Coord> ReadRootOrigin() {
    Coord origin;
    for (int axis = 0; axis < 3; ++axis) {
      LB_RETURN_IF_ERROR(reader_.Read(origin[axis]));
      const bool is_aligned = origin[axis] % (1 << kRootLog2) == 0;
      if (is_aligned && -kMaxVdbIndex <= origin[axis] && origin[axis] < kMaxVdbIndex) continue;
      return absl::InvalidArgumentError(absl::StrCat("a node begins at voxel ", origin[axis],
                                                     ", not a multiple of ", 1 << kRootLog2,
                                                     " within ", kMaxVdbIndex));
    }
    typename Tree::RootNodeType& root = tree_->root();
    if (root.getValueDepth(origin) >= 0) {
      return absl::InvalidArgumentError(
          absl::StrCat("two nodes begin at voxel ", FormatCoord(origin)));
    }
    return origin;
  }

  // A node of the two inner levels with all below it.
  template <typename LevelType>
  absl::Status ReadNode(const Coord& origin) {
    auto child_mask = std::make_unique<typename LevelType::Mask>();
    auto active_mask = std::make_unique<typename LevelType::Mask>();
    LB_RETURN_IF_ERROR(reader_.Read(*child_mask));
    LB_RETURN_IF_ERROR(reader_.Read(*active_mask));
    LB_RETURN_IF_ERROR(ReadTiles<LevelType>(origin, *child_mask, *active_mask));
    for (size_t slot = 0; slot < LevelType::kNumSlots; ++slot) {
      if (!IsOn(*child_mask, slot)) continue;
      const Coord child = SlotOrigin<LevelType>(origin, slot);
      if constexpr (LevelType::kSlotLog2 == Upper::kSlotLog2) {
        LB_RETURN_IF_ERROR(ReadNode<Lower>(child));
      } else {
        LB_RETURN_IF_ERROR(AddLeaf(child));
      }
    }
    return absl::OkStatus();
  }

  // The values of slots that are no children; those that are as the tree is without them are not
  // entered.
  template <typename LevelType>
  absl::Status ReadTiles(const Coord& origin, VdbMask child_mask, VdbMask active_mask) {
    constexpr auto kTileLevel = LevelType::kSlotLog2 == Upper::kSlotLog2 ? 2 : 1;
    std::vector<float> values(LevelType::kNumSlots * kSize);
    LB_RETURN_IF_ERROR(ReadVdbValues(reader_, format_, active_mask, values));
    const Value background = ToValue<Value>(format_.background);
    for (size_t slot = 0; slot < LevelType::kNumSlots; ++slot) {
      if (IsOn(child_mask, slot)) continue;
      const Value value = ToValue<Value>(&values[slot * kSize]);
      const bool is_active = IsOn(active_mask, slot);
      const Coord place = SlotOrigin<LevelType>(origin, slot);
      LB_RETURN_IF_ERROR(CheckFinite({&values[slot * kSize], kSize}, place));
      if (is_active || value != background) tree_->addTile(kTileLevel, place, value, is_active);
    }
    return absl::OkStatus();
  }

  absl::Status AddLeaf(const Coord& origin) {
    LB_RETURN_IF_ERROR(reader_.Take(sizeof(Leaf::Mask)).status());  // comes again with the values
    leaves_.push_back(tree_->touchLeaf(origin));
    return absl::OkStatus();
  }

  absl::Status ReadLeafValues(LeafNode& leaf) {
    Leaf::Mask active_mask;
    LB_RETURN_IF_ERROR(reader_.Read(active_mask));
    std::array<float, Leaf::kNumSlots * kSize> values;
    LB_RETURN_IF_ERROR(ReadVdbValues(reader_, format_, active_mask, values));
    LB_RETURN_IF_ERROR(CheckFinite(values, leaf.origin()));
    for (size_t i = 0; i < Leaf::kNumSlots; ++i) {
      leaf.setValueOnly(static_cast<openvdb::Index>(i), ToValue<Value>(&values[i * kSize]));
    }
    typename LeafNode::NodeMaskType mask;
    for (size_t word = 0; word < active_mask.size(); ++word) {
      mask.template getWord<uint64_t>(static_cast<openvdb::Index>(word)) = active_mask[word];
    }
    leaf.setValueMask(mask);
    return absl::OkStatus();
  }

  absl::Status ReadFloats(float* value) {
    for (int c = 0; c < kSize; ++c) LB_RETURN_IF_ERROR(reader_.Read(value[c]));
    return CheckFinite({value, kSize}, Coord(0, 0, 0));
  }

  static absl::Status CheckFinite(std::span<const float> values, const Coord& place) {
    for (const float value : values) {
      if (std::isfinite(value)) continue;
      return absl::InvalidArgumentError(
          absl::StrCat("a value is ", value, ", in the node at voxel ", FormatCoord(place)));
    }
    return absl::OkStatus();
  }

  ByteReader reader_;
  VdbValueFormat format_;
  typename Tree::Ptr tree_;
  std::vector<LeafNode*> leaves_;  // in the order of the file
};

}  // namespace

absl::StatusOr<openvdb::FloatTree::Ptr> ReadVdbFloatTree(const VdbGrid& grid) {
  return TreeReader<openvdb::FloatTree>(grid).Read();
}

absl::StatusOr<openvdb::Vec3STree::Ptr> ReadVdbVectorTree(const VdbGrid& grid) {
  return TreeReader<openvdb::Vec3STree>(grid).Read();
}

}  // namespace liquidblend::ingest
