"""What a building or a place of an OpenStreetMap extract is used for."""

from __future__ import annotations

from cogmap.data.osm import Tags

HOME = "home"
SHOP = "shop"
FOOD = "food"
SCHOOL = "school"
OFFICE = "office"
LEISURE = "leisure"
WORKS = "works"
FUNCTIONS = (HOME, SHOP, FOOD, SCHOOL, OFFICE, LEISURE, WORKS)

_OF_AMENITY = {
    **dict.fromkeys(("restaurant", "cafe", "bar", "pub", "fast_food", "biergarten"), FOOD),
    **dict.fromkeys(("school", "kindergarten", "university", "college", "library"), SCHOOL),
    **dict.fromkeys(("bank", "post_office", "townhall", "police", "courthouse"), OFFICE),
    **dict.fromkeys(("doctors", "dentist", "clinic", "hospital", "community_centre"), OFFICE),
    **dict.fromkeys(("theatre", "cinema", "place_of_worship", "arts_centre", "casino"), LEISURE),
    **dict.fromkeys(("nightclub", "museum"), LEISURE),
    **dict.fromkeys(("pharmacy", "marketplace"), SHOP),
    **dict.fromkeys(("fuel", "car_wash", "fire_station", "recycling"), WORKS),
}
_OF_BUILDING = {
    **dict.fromkeys(("apartments", "house", "residential", "detached", "terrace"), HOME),
    **dict.fromkeys(("dormitory", "semidetached_house", "bungalow"), HOME),
    **dict.fromkeys(("retail", "supermarket", "kiosk"), SHOP),
    **dict.fromkeys(("school", "university", "kindergarten", "college"), SCHOOL),
    **dict.fromkeys(("office", "commercial", "public", "civic", "hospital"), OFFICE),
    **dict.fromkeys(("church", "chapel", "cathedral", "hotel", "stadium"), LEISURE),
    **dict.fromkeys(("industrial", "warehouse", "train_station", "garages"), WORKS),
}
_OF_KEY = {
    "shop": SHOP,
    "office": OFFICE,
    "tourism": LEISURE,
    "historic": LEISURE,
    "leisure": LEISURE,
    "craft": WORKS,
}


def function_of(tags: Tags) -> str:
    """Return one of FUNCTIONS; an empty string if the tags imply none."""
    for key, table in (("amenity", _OF_AMENITY), ("building", _OF_BUILDING)):
        function = table.get(tags.get(key, ""), "")
        if function:
            return function

    for key, function in _OF_KEY.items():
        if key in tags:
            return function

    return ""
