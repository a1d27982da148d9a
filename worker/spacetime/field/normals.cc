#include "worker/spacetime/field/normals.h"

#include "core/mesh/cross_product.h"

namespace liquidblend::spacetime {
namespace {

Eigen::Vector4f Cross4(const Eigen::Vector4f& a, const Eigen::Vector4f& b,
                       const Eigen::Vector4f& c) {
  Eigen::Matrix<float, 4, 3> columns;
  columns << a, b, c;
  return mesh::CrossProduct(columns);
}

// Mean edge along one direction of the cell: from corners `from` to corners `to`.
template <size_t N, size_t M>
Eigen::Vector4f MeanEdge(const Eigen::Matrix4Xf& points, const std::array<int32_t, N>& cell,
                         const std::array<int, M>& from, const std::array<int, M>& to) {
  Eigen::Vector4f sum = Eigen::Vector4f::Zero();
  for (size_t m = 0; m < M; ++m) sum += points.col(cell[to[m]]) - points.col(cell[from[m]]);
  return sum / static_cast<float>(M);
}

Eigen::Vector4f CellNormal(const Eigen::Matrix4Xf& p, const mesh::Hexahedron& cell) {
  return Cross4(MeanEdge<8, 4>(p, cell, {0, 2, 4, 6}, {1, 3, 5, 7}),
                MeanEdge<8, 4>(p, cell, {0, 1, 4, 5}, {2, 3, 6, 7}),
                MeanEdge<8, 4>(p, cell, {0, 1, 2, 3}, {4, 5, 6, 7}));
}

Eigen::Vector4f CellNormal(const Eigen::Matrix4Xf& p, const mesh::Wedge& cell) {
  return 0.5f * Cross4(MeanEdge<6, 2>(p, cell, {0, 3}, {1, 4}),
                       MeanEdge<6, 2>(p, cell, {0, 3}, {2, 5}),
                       MeanEdge<6, 3>(p, cell, {0, 1, 2}, {3, 4, 5}));
}

Eigen::Vector4f CellNormal(const Eigen::Matrix4Xf& p, const mesh::Pyramid& cell) {
  return Cross4(MeanEdge<5, 2>(p, cell, {0, 3}, {1, 2}), MeanEdge<5, 2>(p, cell, {0, 1}, {3, 2}),
                MeanEdge<5, 4>(p, cell, {0, 1, 2, 3}, {4, 4, 4, 4})) /
         3.0f;
}

Eigen::Vector4f CellNormal(const Eigen::Matrix4Xf& p, const mesh::Tetrahedron& cell) {
  return Cross4(MeanEdge<4, 1>(p, cell, {0}, {1}), MeanEdge<4, 1>(p, cell, {0}, {2}),
                MeanEdge<4, 1>(p, cell, {0}, {3})) /
         6.0f;
}

// Cell normals in parallel, then added to the corners in the order of the cells.
template <typename Cell>
void AddNormals(const Eigen::Matrix4Xf& points, const std::vector<Cell>& cells,
                const parallel::Arena& arena, Eigen::Matrix4Xf& normals) {
  Eigen::Matrix4Xf of_cell(4, static_cast<int64_t>(cells.size()));
  arena.For(of_cell.cols(), [&](int64_t c) { of_cell.col(c) = CellNormal(points, cells[c]); });
  for (size_t c = 0; c < cells.size(); ++c) {
    for (const int32_t v : cells[c]) normals.col(v) += of_cell.col(static_cast<int64_t>(c));
  }
}

}  // namespace

void ComputeNormals(mesh::SpaceTimeMesh& mesh, const parallel::Arena& arena) {
  Eigen::Matrix4Xf points = mesh.vertices;
  points.topRows<3>() /= static_cast<float>(mesh.edge_length_m);
  mesh.normals = Eigen::Matrix4Xf::Zero(4, mesh.num_vertices());
  AddNormals(points, mesh.hexahedra, arena, mesh.normals);
  AddNormals(points, mesh.wedges, arena, mesh.normals);
  AddNormals(points, mesh.pyramids, arena, mesh.normals);
  AddNormals(points, mesh.tetrahedra, arena, mesh.normals);
  arena.For(mesh.num_vertices(), [&](int64_t v) {
    const float length = mesh.normals.col(v).norm();
    if (length > 0) mesh.normals.col(v) /= length;
  });
}

}  // namespace liquidblend::spacetime
