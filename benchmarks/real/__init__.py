"""What nobody simulated: the product's modules on recordings of real cameras."""
