/* test_skeleton_text.c: skeletons and joints written by hand, a joint per line: order, parents, and what is refused.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "vg.h"

#include "test.h"


static int read_groups(vg_joint_groups *g, const char *text, int base, vg_err *e)
{
    return vg_joint_groups_read(g, text, strlen(text), base, "joints", e);
}

static void test_groups(void)
{
    vg_joint_groups g;
    vg_err e;
    CHECK(read_groups(&g,
                      "# an arm\nhand elbow vertices 7 9\nelbow arm vertices 12 13, 14 15 # bent\n\narm - vertices "
                      "3\nleg - vertices 1 2",
                      0, &e) == VG_OK);
    CHECK(g.n == 4);
    if (g.n == 4) {
        CHECK_TEXT(g.at[0].name, "arm");
        CHECK(g.at[0].parent == UINT32_MAX && g.at[0].nvertices == 1 && g.at[0].vertices[0] == 3 &&
              g.at[0].line == 5);
        CHECK_TEXT(g.at[1].name, "elbow");
        CHECK(g.at[1].parent == 0 && g.at[1].nvertices == 4 && g.at[1].vertices[0] == 12 &&
              g.at[1].vertices[3] == 15);
        CHECK_TEXT(g.at[2].name, "hand");
        CHECK(g.at[2].parent == 1 && g.at[2].nvertices == 2 && g.at[2].line == 2);
        CHECK_TEXT(g.at[3].name, "leg");
        CHECK(g.at[3].parent == UINT32_MAX);
    }
    vg_joint_groups_clear(&g);
    CHECK(read_groups(&g, "a - vertices 1 2 3 4 5 6 7 8 9 10 11 12\n", 1, &e) == VG_OK);
    CHECK(g.n == 1 && g.at[0].nvertices == 12 && g.at[0].vertices[0] == 0 && g.at[0].vertices[11] == 11);
    vg_joint_groups_clear(&g);
}

static void test_groups_refused(void)
{
    static const struct {
        const char *text, *says;
    } bad[] = {
        {"", "'joints' names no joint"},
        {"# nothing\n", "names no joint"},
        {"a - vertices\n", "line 1: a joint is 'JOINT PARENT vertices VERTEX VERTEX ...'"},
        {"a - 1 2 3\n", "line 1: a joint is"},
        {"a - 0 0 0 1 1 1\n", "line 1: a joint is"},
        {"a - vertices 1\nb c vertices 2\n", "line 2: the parent 'c' of 'b' is not defined"},
        {"a - vertices 1\nb a vertices 2\na b vertices 3\n", "line 3: 'a' is already defined, in line 1"},
        {"a b vertices 1\nb a vertices 2\n", "has a cycle of joints"},
        {"r - vertices 0\na a vertices 1\n", "has a cycle of joints"},
        {"a - vertices 1 2 1\n", "line 1: joint 'a' has a vertex twice"},
        {"a - vertices 1 -2\n", "there is no vertex -2"},
        {"a - vertices 1 2.5\n", "'2.5' is not a vertex number"},
        {"a - vertices 4294967295\n", "there is no vertex 4294967295"},
        {"\xff - vertices 1\n", "not UTF-8"},
    };
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        vg_joint_groups g;
        vg_err e = {0};
        CHECK(read_groups(&g, bad[i].text, 0, &e) == VG_EINPUT);
        CHECK(g.n == 0 && !g.at);
        if (!strstr(e.message, bad[i].says)) printf("%s\n", e.message);
        CHECK(strstr(e.message, bad[i].says));
    }
}

TESTS({"groups of vertices are joints, parents first", test_groups},
      {"groups that make no sense are refused by line", test_groups_refused})
