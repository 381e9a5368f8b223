"""The labels that sub-maps keep."""

import numpy as np

from cogmap.services.codelets.sub_maps.sub_maps import NEW, kept_labels


def kept(before, after, next_label=10):
    return kept_labels(np.array(before), np.array(after), next_label).tolist()


def test_the_same_partition_keeps_its_labels_whatever_it_is_called():
    assert kept([7, 7, 3, 3], [1, 1, 0, 0]) == [7, 7, 3, 3]


def test_of_two_that_merge_the_larger_gives_its_label():
    assert kept([4, 4, 4, 6], [0, 0, 0, 0]) == [4, 4, 4, 4]


def test_of_two_parts_the_larger_keeps_the_label_and_the_other_gets_a_new_one():
    assert kept([4, 4, 4, 4, 4], [0, 0, 1, 1, 1]) == [10, 10, 4, 4, 4]


def test_objects_that_had_no_label_take_that_of_their_sub_map():
    assert kept([NEW, 5, NEW], [0, 0, 1]) == [5, 5, 10]


def test_new_labels_are_given_in_the_order_of_objects():
    assert kept([NEW, NEW, NEW], [2, 0, 1]) == [10, 11, 12]


def test_nothing_has_no_labels():
    assert kept([], []) == []
