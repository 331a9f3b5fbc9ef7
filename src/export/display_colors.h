/// @file Colours of classes in pages and pictures.
#pragma once

#include "bki_mapping/core/class_table.h"

namespace bki_mapping {

/// The same classes in colours that people can tell apart. The colours of data sets are made for labels in
/// images: unlabelled is black, which stands out in a map, and some classes have nearly the same colour. Here
/// unlabelled is grey, and of classes with nearly the same colour all but the first take another one.
ClassTable displayTable(const ClassTable& classes);

}  // namespace bki_mapping
