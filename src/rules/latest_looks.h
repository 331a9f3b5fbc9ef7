/// @file What the latest looks say of the state of a voxel: Equation 12c in docs/method.md. No rule of the
/// paper.
#pragma once

#include <cstddef>

#include "bki_mapping/map/block.h"
#include "rules/view_kernels.h"

namespace bki_mapping {

/// Number of intervals since the last hit in which a voxel was seen void, from which on it is free.
constexpr int kVoidsToClear = 2;
/// What has at least this many times StateRules::mostVote has stayed: with the preset `robot`, what about a
/// hundred scans have hit.
constexpr EvidenceUnits kStay = 6;
/// What has stayed remains as long as it was hit for this many times as long as it has been crossed since.
constexpr std::uint64_t kHitsOverCrossed = 3;

/// What the looks say of a voxel: kKept, kCleared, or kNotOverruled where the sum decides.
/// @param offset of the voxel in its block. @param has_stayed whether the likeliest class of
/// the voxel has at least kStay times StateRules::mostVote.
std::int32_t verdictOf(const Looks& looks, std::size_t offset, bool has_stayed);

/// The same for all voxels of a block: where looks decide, overwrites what the voxels around say.
/// @param most_vote StateRules::mostVote. @return whether they decide anywhere.
bool overruleByLooks(const Block& block, EvidenceUnits most_vote, Overruled& overruled);

}  // namespace bki_mapping
