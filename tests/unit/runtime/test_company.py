"""When a process ends that ends with another."""

from __future__ import annotations

import pytest

from cogmap.bus.interface import Member
from cogmap.runtime.company import ABSENT_S, AWAITED_S, Company

DRIVE = Member("observer", "observer")


@pytest.fixture
def company() -> Company:
    return Company("observer", now_s=0.0)


def test_it_stays_while_the_other_is_there(company: Company) -> None:
    company.note(DRIVE, True, now_s=1.0)

    assert not company.is_over(1.0 + AWAITED_S)


def test_it_ends_a_while_after_the_other_has_left(company: Company) -> None:
    company.note(DRIVE, True, now_s=1.0)
    company.note(DRIVE, False, now_s=50.0)

    assert not company.is_over(49.9 + ABSENT_S)
    assert company.is_over(50.0 + ABSENT_S)


def test_it_stays_if_the_other_comes_back_in_time(company: Company) -> None:
    company.note(DRIVE, True, now_s=1.0)
    company.note(DRIVE, False, now_s=50.0)
    company.note(DRIVE, True, now_s=52.0)

    assert not company.is_over(60.0 + ABSENT_S)


def test_it_waits_longer_for_one_that_has_not_come_yet(company: Company) -> None:
    assert not company.is_over(AWAITED_S - 0.1)
    assert company.is_over(AWAITED_S)


def test_other_modules_are_no_company(company: Company) -> None:
    company.note(DRIVE, True, now_s=1.0)
    company.note(DRIVE, False, now_s=50.0)
    company.note(Member("epam", "epam"), True, now_s=51.0)

    assert company.is_over(50.0 + ABSENT_S)
