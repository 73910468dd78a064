// SPDX-License-Identifier: GPL-3.0-or-later
// Fields and tables: what a person sees, also of documents that have nothing of what was hoped for.
#include "admin-cli/document.h"

#include <gtest/gtest.h>

namespace pmcd::admin {
namespace {

TEST(Document, FieldsAsAPersonReadsThem) {
  const ordered_json object{{"text", "bunny"}, {"count", 12}, {"part", 0.123456}, {"yes", true}, {"none", nullptr}};
  EXPECT_EQ(field(object, "text"), "bunny");
  EXPECT_EQ(field(object, "count"), "12");
  EXPECT_EQ(field(object, "part"), "0.1235");
  EXPECT_EQ(field(object, "yes"), "true");
  EXPECT_EQ(field(object, "none"), "-");
  EXPECT_EQ(field(object, "missing"), "-");
}

TEST(Document, NothingOfADocumentIsObeyedByATerminal) {
  const ordered_json object{{"text", "a\x1b[31mb\n"}, {"list", {"\x1b]0;x", "\xc2\x9b"}}};
  EXPECT_EQ(field(object, "text"), "a?[31mb?");
  EXPECT_EQ(field(object, "list"), "[\"\\u001b]0;x\",\"?\"]");
}

TEST(Document, NumbersAndCountsOfTheWrongKindAreNone) {
  const ordered_json object{{"text", "1"}, {"minus", -1}, {"part", 1.5}, {"count", 3}};
  EXPECT_EQ(number_of(object, "text"), std::nullopt);
  EXPECT_EQ(number_of(object, "minus"), -1);
  EXPECT_EQ(number_of(object, "count"), 3);
  EXPECT_EQ(number_of(object, "missing"), std::nullopt);
  EXPECT_EQ(count_of(object, "count"), 3u);
  EXPECT_EQ(count_of(object, "part"), 0u);
  EXPECT_EQ(count_of(object, "minus"), 0u);
}

TEST(Document, RowsAndObjectsOfTheWrongKindAreEmpty) {
  const ordered_json document{{"rows", {1, {{"a", 1}}, "x"}}, {"object", {{"b", 2}}}};
  EXPECT_EQ(rows_of(document, "rows"), ordered_json::array({{{"a", 1}}}));
  EXPECT_EQ(rows_of(document, "object"), ordered_json::array());
  EXPECT_EQ(rows_of(document, "missing"), ordered_json::array());
  EXPECT_EQ(object_of(document, "object"), (ordered_json{{"b", 2}}));
  EXPECT_EQ(object_of(document, "rows"), ordered_json::object());
}

TEST(Document, Tables) {
  const Lines expected{"name   bytes  note", "b\xc3\xbcste     12  x", "a       1000"};
  EXPECT_EQ(
      table_lines({{"name", false}, {"bytes"}, {"note", false}}, {{"b\xc3\xbcste", "12", "x"}, {"a", "1000", ""}}),
      expected);
  EXPECT_EQ(table_lines({{"name", false}, {"bytes"}}, {}), Lines{"name  bytes"});
  const ordered_json rows{{{"name", "a"}, {"bytes", 1000}}, {{"name", "long name"}}};
  EXPECT_EQ(table_of(rows, {"name", "bytes"}), (Lines{"name       bytes", "a           1000", "long name      -"}));
}

TEST(Document, FieldLines) {
  const ordered_json mesh{{"name", "a"}, {"vertices", 8}, {"levels", {1, 2}}};
  EXPECT_EQ(field_lines(mesh), (Lines{"name      a", "vertices  8"}));
}

TEST(Document, CutBetweenCharacters) {
  EXPECT_EQ(cut_to("b\xc3\xbcste", 2), "b\xc3\xbc");
  EXPECT_EQ(cut_to("b\xc3\xbcste", 1), "b");
  EXPECT_EQ(cut_to("b\xc3\xbcste", 5), "b\xc3\xbcste");
  EXPECT_EQ(cut_to("b\xc3\xbcste", 50), "b\xc3\xbcste");
  EXPECT_EQ(cut_to("abc", 0), "");
}

}  // namespace
}  // namespace pmcd::admin
