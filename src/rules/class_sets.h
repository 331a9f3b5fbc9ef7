/// @file The sets of classes for which rules differ. The paper treats all classes alike.
#pragma once

#include "bki_mapping/core/class_table.h"

namespace bki_mapping {

/// The classes that cannot move: those without the flag dynamic, except the unlabelled one.
ClassSet fixedClasses(const ClassTable& classes);

/// The classes that ask their neighbourhood (12b): what can be parked; or all but the unlabelled one, if the
/// table does not say what can move.
ClassSet askingClasses(const ClassTable& classes);

/// ScanRules::thin_reach: 0.3 m, rounded down to voxels, but at least one, where the table does not say what
/// can move, since voids would then clear thin things, too; otherwise 0. @param resolution edge of a voxel
/// [m].
int thinReach(const ClassTable& classes, double resolution);

/// ScanRules::void_margin, rounded down. @param margin, resolution [m].
int voidMargin(double margin, double resolution);

}  // namespace bki_mapping
